// A mesh lit by LIGHTS spherical Gaussians, with GLOSS or without: software renderers take both
// sides of a branch. TEXTURED: one material, with those of the three textures that it has.

#include "sg_gloss.glsl"
#include "sg_matt.glsl"
#include "textured_surface.glsl"

uniform vec4 eye;                      // the view is along eye.xyz - eye.w * place
uniform float lights[4 * LIGHTS];      // axes and sharpness
uniform float amplitudes[3 * LIGHTS];
uniform sampler2D matt;                // a row for each light: lobes from behind to straight above
#if GLOSS
uniform sampler2D gloss;               // a row for each material: lobes by the view's cosine
#endif
in vec3 shadingOut;
in vec3 bouncedOut;
in vec3 placeOut;
#if TEXTURED
uniform vec4 factors;                  // base colour, metalness
uniform vec4 finish;                   // reflectance of what is no metal, roughness
#if COLOUR_MAP
uniform sampler2D colourMap;
uniform vec4 colourPlace, colourLimits;
#endif
#if SURFACE_MAP
uniform sampler2D surfaceMap;
uniform vec4 surfacePlace, surfaceLimits;
#endif
#if NORMAL_MAP
uniform sampler2D normalMap;
uniform vec4 normalPlace, normalLimits;  // place.w: how much the normals bend
#endif
in vec3 paintOut;
in vec4 mappingsOut;
#else
uniform sampler2D materials;           // row 0: albedo, specular; row 1: roughness, tint
flat in float objectOut;
#endif
in vec4 edges[EDGES];

vec4 light(int number) {
  int at = 4 * number;
  return vec4(lights[at], lights[at + 1], lights[at + 2], lights[at + 3]);
}

vec3 amplitude(int number) {
  int at = 3 * number;
  return vec3(amplitudes[at], amplitudes[at + 1], amplitudes[at + 2]);
}

#if TEXTURED
// What a texture has at one of two mappings. place: two factors to its own coordinates, and which
// mapping; limits: from where to where it is not clamped. A little sharper than the level that the
// card takes by the longer side of a pixel.
vec3 texelAt(sampler2D map, vec4 place, vec4 limits) {
  vec2 mapping = place.z < 0.5 ? mappingsOut.xy : mappingsOut.zw;
  return texture(map, clamp(mapping * place.xy, limits.xy, limits.zw), -0.5).rgb;
}

Look seenLook() {
  vec3 base = factors.rgb * paintOut, shares = vec3(1.0), normal = normalize(shadingOut);
#if COLOUR_MAP
  base *= texelAt(colourMap, colourPlace, colourLimits);
#endif
#if SURFACE_MAP
  shares = texelAt(surfaceMap, surfacePlace, surfaceLimits);
#endif
  Look seen = lookOf(normal, base, factors.w * shares.b, finish.rgb * shares.r, finish.w * shares.g);
#if NORMAL_MAP
  vec3 bump = 2.0 * texelAt(normalMap, normalPlace, normalLimits) - 1.0;
  seen.roughness = roughenedSlope(seen.roughness, length(bump), normalPlace.w);
  bump.xy *= normalPlace.w;
  vec2 mapping = normalPlace.z < 0.5 ? mappingsOut.xy : mappingsOut.zw;
  seen.normal = bentNormal(normal, bump, dFdx(placeOut), dFdy(placeOut), dFdx(mapping),
                           dFdy(mapping));
#endif
  seen.specular = min(seen.specular, MOST_SPECULAR);
  seen.roughness = max(seen.roughness, LEAST_SLOPE);
  return seen;
}
#else
Look seenLook() {
  int row = int(objectOut + 0.5);
  vec4 look = texelFetch(materials, ivec2(row, 0), 0);
  vec4 rest = texelFetch(materials, ivec2(row, 1), 0);
  return Look(normalize(shadingOut), look.rgb, rest.gba, look.a, rest.r);
}
#endif

#if GLOSS
#if TEXTURED
// Between the rows of the table, which has all materials.
vec4 fittedGloss(float column, Look look) {
  vec2 start = vec2(GRID_START), end = vec2(GRID_END), steps = vec2(GRID_STEPS);
  vec2 given = vec2(look.roughness, look.specular);
  vec2 at = log(clamp(given, start, end) / start) / log(end / start) * (steps - 1.0);
  float lower = min(floor(at.y), steps.y - 2.0);
  vec2 size = vec2(float(GLOSS_COLUMNS), steps.x * steps.y);
  vec2 here = (vec2(column, lower * steps.x + at.x) + 0.5) / size;
  vec4 fitted = mix(texture(gloss, here), texture(gloss, here + vec2(0.0, steps.x / size.y)),
                    at.y - lower);
  fitted.x = exp(fitted.x);
  fitted.w += log(max(min(look.specular / start.y, 1.0), 1e-6));
  return fitted;
}
#else
vec4 fittedGloss(float column, Look look) {
  int left = min(int(column), GLOSS_COLUMNS - 2), row = int(objectOut + 0.5);
  return mix(texelFetch(gloss, ivec2(left, row), 0), texelFetch(gloss, ivec2(left + 1, row), 0),
             column - float(left));
}
#endif

Gloss seenGloss(Look look) {
  vec3 view = normalize(eye.xyz - eye.w * placeOut);
  float facing = dot(look.normal, view);
  float seen = clamp(facing, LEAST_VIEW, 1.0);
  vec4 fitted = fittedGloss(seen * float(GLOSS_COLUMNS - 1), look);
  return glossOf(fitted, look.normal, view, facing, seen, look.roughness, look.specular);
}
#endif

vec3 surfaceColour() {
  Look look = seenLook();
  vec3 lit = bouncedOut;
#pragma unroll_loop_start
  for (int i = 0; i < LIGHTS; i++) {
    float column = dot(look.normal, light(i).xyz) * MATT_HALF + (MATT_HALF + 0.5);
    vec3 lobe = texelFetch(matt, ivec2(column, i), 0).rgb;
    lit += amplitude(i) * mattRadiance(lobe, edges[i / 4][i % 4]);
  }
#pragma unroll_loop_end
  lit *= look.albedo;
#if GLOSS
  Gloss seen = seenGloss(look);
#pragma unroll_loop_start
  for (int i = 0; i < LIGHTS; i++) {
    lit += amplitude(i) * look.tint
      * glossRadiance(seen, light(i), edges[(LIGHTS + 3) / 4 + i / 4][i % 4], look.normal);
  }
#pragma unroll_loop_end
#endif
  return lit;
}
