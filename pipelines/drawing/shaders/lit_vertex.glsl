// A mesh lit by spherical Gaussians and by its own surfaces (bounced: radiance of an albedo of 1
// under what they reflect): distances to the edge of the visible sky, four in a vector:
// of LIGHTS matt lobes, and after these, from a new vector on, of as many glossy ones: attributes,
// or, with EDGES_FETCHED, texels of lit_distances.glsl, EDGE_ROWS rows a vector. With textures
// (TEXTURED) it has places in them and a colour, else the number of its material.

// Textures, and distances as attributes: there are no more than 16. So the other vectors take
// bounced with them, shading and paint red and green behind them, shading blue as its length less 1.
#if TEXTURED
#if EDGES_FETCHED
in vec3 shading, bounced;
in vec3 paint;
#else
in vec4 shading;
in vec4 paint;
#endif
in vec4 mappings;
out vec3 paintOut;
out vec4 mappingsOut;
#else
in vec3 shading, bounced;
in float object;
flat out float objectOut;
#endif
#if EDGES_FETCHED
in float number;
uniform sampler2D fetchedEdges;
#else
in vec4 edge0, edge1, edge2, edge3, edge4, edge5, edge6, edge7, edge8, edge9, edge10, edge11;
#endif
out vec3 shadingOut;
out vec3 bouncedOut;
out vec3 placeOut;
out vec4 edges[EDGES];

void placeVertex() {
#if TEXTURED && !EDGES_FETCHED
  shadingOut = normalize(shading.xyz);
  bouncedOut = vec3(shading.w, paint.w, length(shading.xyz) - 1.0);
#else
  shadingOut = shading;
  bouncedOut = bounced;
#endif
  placeOut = vertexMC.xyz;
#if TEXTURED
  paintOut = paint.rgb;
  mappingsOut = mappings;
#else
  objectOut = object;
#endif
#if EDGES_FETCHED
  int vertex = int(number + 0.5), columns = textureSize(fetchedEdges, 0).x;
  ivec2 at = ivec2(vertex % columns, vertex / columns);
#pragma unroll_loop_start
  for (int i = 0; i < EDGES; i++) {
    edges[i] = texelFetch(fetchedEdges, at + ivec2(0, i * EDGE_ROWS), 0);
  }
#pragma unroll_loop_end
#else
  vec4 given[12] = vec4[12](edge0, edge1, edge2, edge3, edge4, edge5,
                            edge6, edge7, edge8, edge9, edge10, edge11);
#pragma unroll_loop_start
  for (int i = 0; i < EDGES; i++) {
    edges[i] = given[i];
  }
#pragma unroll_loop_end
#endif
}
