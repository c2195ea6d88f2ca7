// Fur: which layers of a hair's photograph stand where, by the depth code of its alpha.
//
// Layers are numbered from 1, the tips' own. Each holds codeSteps codes: layer n those from
// (n - 1) codeSteps to n codeSteps - 1. Compared with products, not quotients: they are exact.

// The depth code, 0 to 255, of alpha in [0, 1].
float depthCode(float alpha) {
  return floor(alpha * 255.0 + 0.5);
}

// Whether the code lies below a layer: there is no hair yet.
bool isBelowLayer(float code, float layer, float codeSteps) {
  return code >= layer * codeSteps;
}

// Whether the code lies above a layer: the hair's own layer is one before it.
bool isAboveLayer(float code, float layer, float codeSteps) {
  return code < layer * codeSteps - codeSteps;
}

// Factor on a hair's colour in a layer below its own, I(layer) / I(own layer): the logarithm of I
// falls by decay from layer to layer.
float darkening(float code, float layer, float codeSteps, float decay) {
  float own = floor(code / codeSteps) + 1.0;
  return exp(decay * (own - layer));
}

// What a layer shows of a texel, linear colours and the depth code in alpha; alpha is 0 where no
// hair stands there, else 1. In columns a hair stands in all layers below its own, too.
vec4 hairInLayer(vec4 texel, float layer, float codeSteps, float decay, bool columns) {
  float code = depthCode(texel.a);
  if (isBelowLayer(code, layer, codeSteps)) return vec4(0.0);
  if (!isAboveLayer(code, layer, codeSteps)) return vec4(texel.rgb, 1.0);
  if (!columns) return vec4(0.0);
  return vec4(texel.rgb * darkening(code, layer, codeSteps, decay), 1.0);
}
