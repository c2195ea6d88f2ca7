// The built-in city: a texture in the light at the vertices, STAINED or not, and with GLOSS what
// the surface mirrors of the street, which is looked up in the straight street of a BENT one.

#include "schlick.glsl"
#include "street_reflection.glsl"

uniform sampler2D picture;
#if STAINED
uniform sampler2D stains;
#endif
in vec2 uvOut;
in vec3 litOut;
#if GLOSS
uniform vec3 eye;
uniform sampler2D elevations;
uniform sampler2D sky;
in vec3 shadingOut;
in float glossOut;
in vec3 placeOut;
#if BENT
in vec3 straightOut;
in vec2 turnOut;
#endif
#endif

vec3 surfaceColour() {
  vec3 seen = texture(picture, uvOut, LEVEL_BIAS).rgb * litOut;
#if STAINED
  seen *= texture(stains, uvOut * 0.137).r * 2.5;
#endif
#if GLOSS
  vec3 away = normalize(placeOut - eye), normal = normalize(shadingOut);
  float facing = clamp(-dot(away, normal), 0.0, 1.0);
  vec3 place = placeOut, ray = reflect(away, normal);
#if BENT
  vec2 turned = normalize(turnOut);
  place = straightOut;
  ray.xy = vec2(dot(turned, ray.xy), turned.x * ray.y - turned.y * ray.x);
#endif
  vec3 mirrored = mirroredStreet(elevations, sky, vec4(ELEVATION_BOX), vec2(ELEVATION_ROWS),
                                 place, ray);
  seen += schlick(0.07, facing) * glossOut * mirrored;
#endif
  return seen;
}
