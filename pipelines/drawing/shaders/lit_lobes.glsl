// Axes of a light's lobes at a vertex: as pipelines/ssdf_lighting/light/lobe_axes.py has them.

// The matt part's. fitted: a row for each light, by the cosine from -1 to 1: factors of the light
// and of the normal.
vec3 mattAxis(sampler2D fitted, int row, vec3 normal, vec3 light) {
  int last = textureSize(fitted, 0).x - 1;
  float place = clamp(0.5 * dot(normal, light) + 0.5, 0.0, 1.0) * float(last);
  int left = min(int(place), last - 1);
  vec2 factors = mix(texelFetch(fitted, ivec2(left, row), 0).xy,
                     texelFetch(fitted, ivec2(left + 1, row), 0).xy, place - float(left));
  return normalize(factors.x * light + factors.y * normal);
}

// The gloss's axis times its sharpness; 0 where there is no gloss. fitted: a row for each material,
// by the view's cosine from 0 to 1: sharpness, or -1 without gloss, factors of the mirrored view
// and of the normal.
vec3 glossAxis(sampler2D fitted, int row, vec3 normal, vec3 view) {
  int last = textureSize(fitted, 0).x - 1;
  float facing = dot(normal, view);
  float place = clamp(facing, LEAST_VIEW, 1.0) * float(last);
  int left = min(int(place), last - 1);
  vec3 found = mix(texelFetch(fitted, ivec2(left, row), 0).xyz,
                   texelFetch(fitted, ivec2(left + 1, row), 0).xyz, place - float(left));
  vec3 axis = found.y * (2.0 * facing * normal - view) + found.z * normal;
  return found.x < 0.0 ? vec3(0.0) : found.x * normalize(axis);
}

// The axis of the gloss under a light of such an axis and sharpness.
vec3 glossAxisUnder(vec3 gloss, vec4 light) {
  return normalize(gloss + light.w * light.xyz);
}
