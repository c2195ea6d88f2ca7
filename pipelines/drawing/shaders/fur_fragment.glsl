// Fur: what a shell shows of the photograph. Bands show a hair in its own layer alone; COLUMNS in
// all below it, too, DECAY darker from layer to layer.

#include "fur_layer.glsl"

uniform sampler2D photograph;
in vec2 uvOut;
flat in float layerOut;

vec3 surfaceColour() {
  vec4 texel = texture(photograph, uvOut);
  float code = depthCode(texel.a);
  if (isBelowLayer(code, layerOut, CODE_STEPS)) discard;
  if (isAboveLayer(code, layerOut, CODE_STEPS)) {
#if COLUMNS
    texel.rgb *= darkening(code, layerOut, CODE_STEPS, DECAY);
#else
    discard;
#endif
  }
  return texel.rgb;
}
