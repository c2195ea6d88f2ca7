// The signed distance from a direction to the edge of the visible sky, at a vertex, of clusters'
// vectors: centre and vectors of a direction lie after one another, four in a texel, and so do 1
// and a vertex's weights. As pipelines/ssdf_lighting/compression/lookup.py.

#include "octahedral.glsl"

uniform sampler2D clusterVectors;
uniform sampler2D vertexWeights;

// Textures are read as lines of texels.
vec4 texelOf(sampler2D line, int number) {
  int columns = textureSize(line, 0).x;
  return texelFetch(line, ivec2(number % columns, number / columns), 0);
}

// Beyond the square's border lies the same border, mirrored about its middle.
int directionAt(int row, int column) {
  if (row < 0 || row >= SIDE) {
    row = clamp(row, 0, SIDE - 1);
    column = SIDE - 1 - column;
  }
  if (column < 0 || column >= SIDE) {
    column = clamp(column, 0, SIDE - 1);
    row = SIDE - 1 - row;
  }
  return row * SIDE + column;
}

// source: where the cluster's vectors begin, texels a direction, where the vertex's weights begin.
float distanceAlong(vec3 source, vec3 axis) {
  vec2 place = (octahedralPlace(axis) + 1.0) * (0.5 * float(SIDE)) - 0.5;
  vec2 corner = floor(place), part = place - corner;
  int row = int(corner.y), column = int(corner.x), width = int(source.y + 0.5);
  int first = int(source.x + 0.5), weights = int(source.z + 0.5);
  ivec4 starts = first + width * ivec4(directionAt(row, column), directionAt(row, column + 1),
                                       directionAt(row + 1, column),
                                       directionAt(row + 1, column + 1));
  vec4 found = vec4(0.0);
  for (int k = 0; k < width; k++) {
    vec4 weight = texelOf(vertexWeights, weights + k);
    found += vec4(dot(weight, texelOf(clusterVectors, starts.x + k)),
                  dot(weight, texelOf(clusterVectors, starts.y + k)),
                  dot(weight, texelOf(clusterVectors, starts.z + k)),
                  dot(weight, texelOf(clusterVectors, starts.w + k)));
  }
  vec2 rows = mix(found.xz, found.yw, part.x);
  return mix(rows.x, rows.y, part.y);
}
