// Scratched glass: a corner of one triangle, whose own normal is facing.

in vec3 shading;
in vec3 facing;
out vec3 shadingOut;
flat out vec3 facingOut;
out vec3 placeOut;

void placeVertex() {
  shadingOut = shading;
  facingOut = facing;
  placeOut = vertexMC.xyz;
}
