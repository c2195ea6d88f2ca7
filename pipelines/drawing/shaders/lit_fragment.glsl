// A mesh lit by LIGHTS spherical Gaussians, with GLOSS or without: software renderers take both
// sides of a branch.

#include "sg_gloss.glsl"
#include "sg_matt.glsl"

uniform vec4 eye;                      // the view is along eye.xyz - eye.w * place
uniform float lights[4 * LIGHTS];      // axes and sharpness
uniform float amplitudes[3 * LIGHTS];
uniform sampler2D matt;                // a row for each light: lobes from behind to straight above
uniform sampler2D materials;           // row 0: albedo, specular; row 1: roughness
#if GLOSS
uniform sampler2D gloss;               // a row for each material: lobes by the view's cosine
#endif
in vec3 shadingOut;
in vec3 placeOut;
flat in float objectOut;
in vec4 edges[EDGES];

vec4 light(int number) {
  int at = 4 * number;
  return vec4(lights[at], lights[at + 1], lights[at + 2], lights[at + 3]);
}

vec3 amplitude(int number) {
  int at = 3 * number;
  return vec3(amplitudes[at], amplitudes[at + 1], amplitudes[at + 2]);
}

#if GLOSS
Gloss seenGloss(vec3 normal, int row, float specular) {
  vec3 view = normalize(eye.xyz - eye.w * placeOut);
  float facing = dot(normal, view);
  float seen = clamp(facing, LEAST_VIEW, 1.0);
  float column = seen * float(GLOSS_COLUMNS - 1);
  int left = min(int(column), GLOSS_COLUMNS - 2);
  vec4 fitted = mix(texelFetch(gloss, ivec2(left, row), 0),
                    texelFetch(gloss, ivec2(left + 1, row), 0), column - float(left));
  float roughness = texelFetch(materials, ivec2(row, 1), 0).r;
  return glossOf(fitted, normal, view, facing, seen, roughness, specular);
}
#endif

vec3 surfaceColour() {
  vec3 normal = normalize(shadingOut);
  int row = int(objectOut + 0.5);
  vec4 look = texelFetch(materials, ivec2(row, 0), 0);
  vec3 lit = vec3(0.0);
#pragma unroll_loop_start
  for (int i = 0; i < LIGHTS; i++) {
    float column = dot(normal, light(i).xyz) * MATT_HALF + (MATT_HALF + 0.5);
    vec3 lobe = texelFetch(matt, ivec2(column, i), 0).rgb;
    lit += amplitude(i) * mattRadiance(lobe, edges[i / 4][i % 4]);
  }
#pragma unroll_loop_end
  lit *= look.rgb;
#if GLOSS
  Gloss seen = seenGloss(normal, row, look.a);
#pragma unroll_loop_start
  for (int i = 0; i < LIGHTS; i++) {
    lit += amplitude(i)
      * glossRadiance(seen, light(i), edges[(LIGHTS + 3) / 4 + i / 4][i % 4], normal);
  }
#pragma unroll_loop_end
#endif
  return lit;
}
