// Scratched glass in its surroundings: one reflection and one refraction of them, and LAYERS of
// scratches, the directions of which are ANGLES, lit by LIGHTS lights. All directions are those of
// the glass; TO_SKY turns them into the environment's, which BRIGHTNESS multiplies. The lamp beside
// it is one of LIGHTS, and shines through scratches from behind. COVERED_A and COVERED_B multiply
// the layers' coverage; STRENGTH is the share of what they cover that counts.

#include "pi.glsl"
#include "box_projection.glsl"
#include "schlick.glsl"
#include "scratch_table.glsl"
#include "surroundings.glsl"

uniform sampler2D sky;
uniform sampler2D lights;
uniform sampler2D table;
uniform sampler2D leaning;
uniform sampler2D coverageA;  // of layers 0 to 3
uniform sampler2D coverageB;  // of layers 4 to 7
in vec3 shadingOut;
flat in vec3 facingOut;
in vec3 placeOut;

const float angles[LAYERS] = float[LAYERS](ANGLES);

vec3 skyAlong(vec3 direction) {
  return surroundings(sky, mat3(TO_SKY), BRIGHTNESS, vec3(LAMP), vec2(LAMP_EDGE),
                      vec3(LAMP_RADIANCE), direction);
}

// What smooth glass shows: light from behind is bent half as much as by one surface, for it leaves
// through another.
vec3 smoothGlass(vec3 view, vec3 normal) {
  float cosine = clamp(dot(normal, view), 0.0, 1.0);
  float mirrored = schlick(BASE_REFLECTANCE, cosine);
  vec3 bent = refract(-view, normal, RELATIVE_INDEX);
  vec3 straight = normalize(mix(bent, -view, 0.5));
  return mix(skyAlong(straight), skyAlong(reflect(-view, normal)), mirrored);
}

vec3 surfaceColour() {
  vec3 view = normalize(vec3(EYE) - placeOut);
  vec3 normal = normalize(shadingOut);
  if (dot(normal, view) * dot(facingOut, view) < 0.0) normal = facingOut;
  float side = dot(normal, view) > 0.0 ? 1.0 : -1.0;
  normal *= side;
  vec3 seen = smoothGlass(view, normal);
  vec3 through = vec3(THROUGH) + vec3(LAMP_RADIANCE) * roundLampSteradians(vec2(LAMP_EDGE))
                               * max(-dot(vec3(LAMP), normal), 0.0) / PI;

  vec3 share = axisShares(facingOut);
  vec3 scattered = vec3(0.0);
  float covered = 0.0, uncovered = 1.0;
  for (int axis = 0; axis < 3; axis++) {
    if (share[axis] < 0.01) continue;
    vec2 uv = boxPlace(placeOut, axis, facingOut[axis] > 0.0, TILE);
    vec4 here[2] = vec4[2](min(texture(coverageA, uv) * vec4(COVERED_A), 1.0),
                           min(texture(coverageB, uv) * vec4(COVERED_B), 1.0));
    for (int layer = 0; layer < LAYERS; layer++) {
      float part = here[layer / 4][layer % 4] * share[axis] * STRENGTH;
      if (part < 0.002) continue;
      vec3 along = vec3(0.0);
      along[(axis + 1) % 3] = cos(angles[layer]);
      along[(axis + 2) % 3] = sin(angles[layer]);
      along = normalize(along - dot(along, normal) * normal);
      vec3 across = cross(normal, along);
      float place = placeAcross(view, across, normal);
      float factor = reflectedShare(leaning, place, dot(view, along));
      vec3 lit = scatteredLight(table, lights, LIGHTS, place, across, normal);
      lit *= 2.0 / (PI * PI) * factor;
      scattered += part * (lit + (1.0 - factor) * through);
      covered += part;
      uncovered *= 1.0 - part;
    }
  }
  if (covered > 0.0) seen = uncovered * seen + (1.0 - uncovered) * scattered / covered;
  return seen;
}
