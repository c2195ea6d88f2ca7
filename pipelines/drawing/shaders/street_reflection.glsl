// What panes and paint at a place in a street along x mirror from a direction: the fronts at
// y = -7 and 7, as both look from the street's middle, and the sky where these do not cover it.
// elevations: y = 7 in the upper half of the picture, radiance times coverage, and coverage;
// box: x and z at each half's lower left corner, and its size; rows: the first and last place
// upwards in a half, 0 to 1, that is not between both.
vec3 mirroredStreet(sampler2D elevations, sampler2D sky, vec4 box, vec2 rows, vec3 place, vec3 ray) {
  float side = ray.y < 0.0 ? -1.0 : 1.0;
  float way = clamp((7.0 - side * place.y) / max(abs(ray.y), 1e-3), 0.0, 80.0);
  vec3 hit = place + way * ray;
  vec2 at = vec2((hit.x - box.x) / box.z, (hit.z - box.y) / box.w);
  at.y = 0.5 * clamp(at.y, rows.x, rows.y) + (side > 0.0 ? 0.5 : 0.0);
  vec4 front = textureLod(elevations, at, 0.0);
  // equirectangularPlace but for the last bit: the built-in drive's photographs are to stay.
  vec2 turned = vec2(0.5 - atan(ray.y, ray.x) * 0.15915494, 0.5 + asin(ray.z) * 0.31830989);
  return front.rgb + (1.0 - front.a) * textureLod(sky, turned, 0.0).rgb;
}
