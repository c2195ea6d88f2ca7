// Cloth: its normals, tangents along u, and places in the material.

in vec3 upright;
in vec3 tangent;
in vec2 place;
out vec3 uprightOut;
out vec3 tangentOut;
out vec2 materialPlace;
out vec3 placeOut;

void placeVertex() {
  uprightOut = upright;
  tangentOut = tangent;
  materialPlace = TILES * place;
  placeOut = vertexMC.xyz;
}
