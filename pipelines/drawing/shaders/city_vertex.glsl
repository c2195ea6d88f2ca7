// The built-in city: matt surfaces, and with GLOSS what they need to mirror the street.

in vec2 uv;
in vec3 lit;
out vec2 uvOut;
out vec3 litOut;
#if GLOSS
in vec3 shading;
in float gloss;
out vec3 shadingOut;
out float glossOut;
out vec3 placeOut;
#endif

void placeVertex() {
  uvOut = uv;
  litOut = lit;
#if GLOSS
  shadingOut = shading;
  glossOut = gloss;
  placeOut = vertexMC.xyz;
#endif
}
