// Fur laid in patches: a vertex of the surface, lifted onto the shell of its layer, bent over along
// the lie by BEND of the thickness at the tips, and blown by the wind.

uniform mat4 MCVCMatrix;
in float layer;
in float hairLength;
in vec3 outward;
in vec3 along;
in vec4 uvs;
in vec2 uvThird;
in vec3 weights;
out vec4 uvsOut;
out vec2 uvThirdOut;
out vec3 weightsOut;
flat out float layerOut;
out vec3 outwardOut;
out vec3 alongOut;
flat out vec3 lampOut;

// How far tips are blown at a place, in thicknesses: gusts of GUST radians a unit of length run over
// the body, and hair trembles within them.
vec3 blown(vec3 at) {
  vec3 towards = vec3(0.8, 0.6, 0.0);
  float swell = 0.6 + 0.4 * sin(GUST * dot(at, towards) - 2.1 * MOMENT);
  float tremor = sin(5.0 * GUST * dot(at, vec3(0.6, -0.7, 0.4)) - 9.0 * MOMENT);
  vec3 push = WIND * swell * (towards + 0.15 * tremor * vec3(-0.6, 0.8, 0.3));
  return push - dot(push, outward) * outward;
}

void placeVertex() {
  // In the middle of what it stands for, but for the skin: so hair is as long of few shells.
  float height = layer < LAYERS ? 1.0 - (layer - 0.5) / LAYERS : 0.0;
  vec3 lean = BEND * along + blown(vertexMC.xyz);
  vec3 lifted = THICKNESS * hairLength * (height * outward + height * height * lean);
  gl_Position = MCDCMatrix * vec4(vertexMC.xyz + lifted, 1.0);
  uvsOut = uvs;
  uvThirdOut = uvThird;
  weightsOut = weights;
  layerOut = layer;
  outwardOut = mat3(MCVCMatrix) * outward;
  alongOut = mat3(MCVCMatrix) * (along + blown(vertexMC.xyz));
  lampOut = mat3(MCVCMatrix) * vec3(LAMP_TOWARDS);
}
