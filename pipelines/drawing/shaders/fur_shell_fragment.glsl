// Fur: the radiance of a shell, Lambertian, under an even SKY, a lamp along the view of radiance
// HEADLIGHT and one of radiance LAMP. What it shows of the photograph is as in fur_fragment.glsl.

#include "fur_layer.glsl"

uniform sampler2D photograph;
in vec2 uvOut;
flat in float layerOut;
in vec3 outwardOut;
flat in vec3 lampOut;

vec3 surfaceColour() {
  vec4 hair = hairInLayer(texture(photograph, uvOut), layerOut, CODE_STEPS, DECAY, COLUMNS == 1);
  if (hair.a == 0.0) discard;
  vec3 facing = normalize(outwardOut);
  if (!gl_FrontFacing) facing = -facing;
  float lamps = HEADLIGHT * max(facing.z, 0.0) + LAMP * max(dot(facing, lampOut), 0.0);
  return hair.rgb * (SKY + lamps);
}
