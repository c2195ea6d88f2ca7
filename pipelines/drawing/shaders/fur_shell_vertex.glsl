// Fur: a vertex of the surface, lifted onto the shell of its layer: one of LAYERS within THICKNESS.

uniform mat4 MCVCMatrix;
in vec2 uv;
in float layer;
in vec3 outward;
out vec2 uvOut;
flat out float layerOut;
out vec3 outwardOut;
flat out vec3 lampOut;

void placeVertex() {
  float height = THICKNESS * (1.0 - layer / LAYERS);
  gl_Position = MCDCMatrix * vec4(vertexMC.xyz + height * outward, 1.0);
  uvOut = uv;
  layerOut = layer;
  outwardOut = mat3(MCVCMatrix) * outward;
  lampOut = mat3(MCVCMatrix) * vec3(LAMP_TOWARDS);
}
