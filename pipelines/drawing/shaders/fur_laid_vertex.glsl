// Fur laid in patches: a vertex of the surface, lifted onto the shell of its layer and bent over
// along the lie by BEND of the thickness at the tips.

uniform mat4 MCVCMatrix;
in float layer;
in float thickness;
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

void placeVertex() {
  float height = 1.0 - layer / LAYERS;
  vec3 lifted = thickness * (height * outward + BEND * height * height * along);
  gl_Position = MCDCMatrix * vec4(vertexMC.xyz + lifted, 1.0);
  uvsOut = uvs;
  uvThirdOut = uvThird;
  weightsOut = weights;
  layerOut = layer;
  outwardOut = mat3(MCVCMatrix) * outward;
  alongOut = mat3(MCVCMatrix) * along;
  lampOut = mat3(MCVCMatrix) * vec3(LAMP_TOWARDS);
}
