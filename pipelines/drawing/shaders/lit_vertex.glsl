// A mesh lit by spherical Gaussians: distances to the edge of the visible sky, four in a vector:
// of LIGHTS matt lobes, and after these, from a new vector on, of as many glossy ones.

in vec3 shading;
in float object;
in vec4 edge0, edge1, edge2, edge3, edge4, edge5, edge6, edge7, edge8, edge9, edge10, edge11;
out vec3 shadingOut;
out vec3 placeOut;
flat out float objectOut;
out vec4 edges[EDGES];

void placeVertex() {
  shadingOut = shading;
  placeOut = vertexMC.xyz;
  objectOut = object;
  vec4 given[12] = vec4[12](edge0, edge1, edge2, edge3, edge4, edge5,
                            edge6, edge7, edge8, edge9, edge10, edge11);
#pragma unroll_loop_start
  for (int i = 0; i < EDGES; i++) {
    edges[i] = given[i];
  }
#pragma unroll_loop_end
}
