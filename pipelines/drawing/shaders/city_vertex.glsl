// The built-in city: matt surfaces, and with GLOSS what they need to mirror the street;
// in a BENT street also where they are in the straight one, and the road's turn there.

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
#if BENT
in vec3 straight;
in vec2 turn;
out vec3 straightOut;
out vec2 turnOut;
#endif
#endif

void placeVertex() {
  uvOut = uv;
  litOut = lit;
#if GLOSS
  shadingOut = shading;
  glossOut = gloss;
  placeOut = vertexMC.xyz;
#if BENT
  straightOut = straight;
  turnOut = turn;
#endif
#endif
}
