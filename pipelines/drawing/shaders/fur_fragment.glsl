// Fur: what a shell shows of the photograph. Bands show a hair in its own layer alone; COLUMNS in
// all below it, too, DECAY darker from layer to layer.

#include "fur_layer.glsl"

uniform sampler2D photograph;
in vec2 uvOut;
flat in float layerOut;

vec3 surfaceColour() {
  vec4 hair = hairInLayer(texture(photograph, uvOut), layerOut, CODE_STEPS, DECAY, COLUMNS == 1);
  if (hair.a == 0.0) discard;
  return hair.rgb;
}
