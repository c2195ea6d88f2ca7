// Distances at the axes of all lobes of a vertex, four lights together: what lit_vertex.glsl gets.

#include "lit_lobes.glsl"
#include "ssdf_lookup.glsl"

uniform vec4 eye;                      // the view is along eye.xyz - eye.w * place
uniform float lights[4 * LIGHTS];      // axes and sharpness
uniform sampler2D vertexPlaces;        // place, row of the gloss
uniform sampler2D vertexNormals;       // unit normal, row of the distances
uniform sampler2D vertexSources;       // of those rows: see distanceAlong
uniform sampler2D mattAxes;
uniform sampler2D glossAxes;

// group: of four lights' matt parts, after all of these of their gloss. Where there is no gloss, or
// no light, pi.
vec4 distancesOf(int vertex, int group) {
  vec4 place = texelOf(vertexPlaces, vertex), normal = texelOf(vertexNormals, vertex);
  vec3 source = texelOf(vertexSources, int(normal.w + 0.5)).xyz;
  const int groups = (LIGHTS + 3) / 4;
  bool isGloss = group >= groups;
  int first = 4 * (isGloss ? group - groups : group);
  vec3 gloss = vec3(0.0);
  if (isGloss) {
    vec3 view = normalize(eye.xyz - eye.w * place.xyz);
    gloss = glossAxis(glossAxes, int(place.w + 0.5), normal.xyz, view);
    if (gloss == vec3(0.0)) return vec4(3.14159265);
  }
  vec4 found = vec4(3.14159265);
  for (int k = 0; k < 4; k++) {
    int number = first + k, at = 4 * number;
    if (number < LIGHTS) {
      vec4 light = vec4(lights[at], lights[at + 1], lights[at + 2], lights[at + 3]);
      vec3 axis = isGloss ? glossAxisUnder(gloss, light)
                          : mattAxis(mattAxes, number, normal.xyz, light.xyz);
      found[k] = distanceAlong(source, axis);
    }
  }
  return found;
}
