// Scratched glass in its surroundings. What is seen is followed through the glass, from surface to
// surface of a tree of its triangles: at each one part is reflected, of what goes on light is bent,
// and scratches show light by their table. They are LAYERS, whose directions are ANGLES. All
// directions are those of the glass; TO_SKY turns them into the environment's, which BRIGHTNESS
// multiplies. The lamp beside it is one of LIGHTS. COVERED_A and COVERED_B multiply the layers'
// coverage; STRENGTH is the share of what they cover that counts.

#include "pi.glsl"
#include "box_projection.glsl"
#include "fresnel.glsl"
#include "scratch_table.glsl"
#include "surroundings.glsl"
#include "triangle_tree.glsl"

uniform sampler2D sky;
uniform sampler2D softSky;    // the same, as wide as bins of the table
uniform sampler2D lights;     // powers in row 0, directions in row 1
uniform sampler2D table;
uniform sampler2D coverageA;  // of layers 0 to 3
uniform sampler2D coverageB;  // of layers 4 to 7
uniform sampler2D tree;
uniform sampler2D corners;
in vec3 shadingOut;
flat in vec3 facingOut;
in vec3 placeOut;

const float angles[LAYERS] = float[LAYERS](ANGLES);

vec3 seenAlong(sampler2D around, vec3 direction) {
  return surroundings(around, mat3(TO_SKY), BRIGHTNESS, vec3(LAMP), vec2(LAMP_EDGE),
                      vec3(LAMP_RADIANCE), direction);
}

// A direction (u, v, n) outside as light goes on on the other side of a surface, inside.
vec3 inGlass(vec3 outside) {
  vec2 bent = outside.xy / INDEX;
  return vec3(bent, sign(outside.z) * sqrt(max(1.0 - dot(bent, bent), 0.0)));
}

// What a scratch of walls that forget the lean shows: lights on its side, and those behind the
// glass, as they come through a face parallel to this one; of what does not, the mean of all light.
vec3 fromLights(vec3 view, mat3 frame) {
  float row = placeAcross(view);
  vec3 tables = tablesOf(leanOf(view));
  vec3 lit = vec3(0.0);
  for (int n = 0; n < LIGHTS; n++) {
    vec3 towards = texelFetch(lights, ivec2(n, 1), 0).xyz * frame;
    float through = 1.0;
    vec3 light = towards;
    if (towards.z < 0.0) {
      light = inGlass(towards);
      through = 1.0 - fresnel(-towards.z, 1.0 / INDEX).x;
    }
    float rho = tabulated(table, tables, row, placeAcross(light));
    lit += texelFetch(lights, ivec2(n, 0), 0).rgb * (through * rho * abs(towards.z));
  }
  // Light in the glass that no parallel face lets out: of a wall that scatters evenly 1 - 1 / INDEX^2.
  float kept = 0.0;
  for (int bin = 0; bin < BINS; bin++) {
    float width = sin((float(bin + 1) / float(BINS) - 0.5) * PI) - sin((float(bin) / float(BINS) - 0.5) * PI);
    kept += tabulated(table, tables, row, float(BINS + bin) + 0.5) * width;
  }
  kept *= INDEX * INDEX / PI * (1.0 - 1.0 / (INDEX * INDEX));
  return 2.0 / (PI * PI) * lit + kept * vec3(THROUGH);
}

// What a scratch of walls that keep the lean shows: what lies along the lines of that lean.
vec3 alongLean(vec3 view, mat3 frame) {
  float row = placeAcross(view);
  float lean = -leanOf(view);
  vec3 tables = tablesOf(lean);
  float inner = sqrt(max(INDEX * INDEX - lean * lean, 0.0));
  float outer = sqrt(max(1.0 - lean * lean, 0.0));
  float ratio = abs(lean) < 1.0 ? inner / max(outer, 1e-3) : 1.0;
  vec3 lit = vec3(0.0);
  for (int bin = 0; bin < 2 * BINS; bin++) {
    int here = bin % BINS;
    float first = sin((float(here) / float(BINS) - 0.5) * PI);
    float last = sin((float(here + 1) / float(BINS) - 0.5) * PI);
    float part = tabulated(table, tables, row, float(bin) + 0.5) * (last - first) / PI;
    if (bin >= BINS) part *= ratio;
    if (part < 1e-4) continue;
    float sine = 0.5 * (first + last) * (bin < BINS ? outer : inner);
    float up2 = 1.0 - lean * lean - sine * sine;
    if (up2 <= 0.0) {
      lit += part * vec3(THROUGH);  // it goes around in the glass
      continue;
    }
    float up = sqrt(up2);
    vec3 outside = vec3(lean, sine, bin < BINS ? up : -up);
    float through = bin < BINS ? 1.0 : 1.0 - fresnel(up, 1.0 / INDEX).x;
    lit += part * (through * seenAlong(softSky, frame * outside) + (1.0 - through) * vec3(THROUGH));
  }
  return lit;
}

// How much of each layer covers a texture's place, for a pixel of a width in scene units. By its own
// derivatives a texture would be asked wrongly where paths part, and slowly in software.
vec4 coverageAt(sampler2D coverage, vec2 uv, float width) {
  float texels = width / TILE * float(textureSize(coverage, 0).x);
  return textureLod(coverage, uv, log2(max(texels, 1.0)));
}

// Light of the scratches at a place, and the share of it that they cover; width: of a pixel there.
vec4 scratches(vec3 place, vec3 facing, vec3 normal, vec3 view, float width) {
  vec3 share = axisShares(facing);
  vec3 scattered = vec3(0.0);
  float covered = 0.0, uncovered = 1.0;
  for (int axis = 0; axis < 3; axis++) {
    if (share[axis] < 0.01) continue;
    vec2 uv = boxPlace(place, axis, facing[axis] > 0.0, TILE);
    vec4 here[2] = vec4[2](min(coverageAt(coverageA, uv, width) * vec4(COVERED_A), 1.0),
                           min(coverageAt(coverageB, uv, width) * vec4(COVERED_B), 1.0));
    for (int layer = 0; layer < LAYERS; layer++) {
      float part = here[layer / 4][layer % 4] * share[axis] * STRENGTH;
      if (part < 0.002) continue;
      vec3 along = vec3(0.0);
      along[(axis + 1) % 3] = cos(angles[layer]);
      along[(axis + 2) % 3] = sin(angles[layer]);
      along = normalize(along - dot(along, normal) * normal);
      mat3 frame = mat3(along, cross(normal, along), normal);
      vec3 local = view * frame;
      scattered += part * (bool(KEEPS) ? alongLean(local, frame) : fromLights(local, frame));
      covered += part;
      uncovered *= 1.0 - part;
    }
  }
  if (covered > 0.0) scattered *= (1.0 - uncovered) / covered;
  return vec4(scattered, 1.0 - uncovered);
}

vec3 surfaceColour() {
  vec3 place = placeOut, facing = facingOut, shading = normalize(shadingOut);
  vec3 way = normalize(placeOut - vec3(EYE));
  vec3 seen = vec3(0.0);
  float left = 1.0;
  float pixel = min(length(dFdx(placeOut)), length(dFdy(placeOut)));
  for (int event = 0; event < EVENTS; event++) {
    // normal points out of the glass, away from which light comes or towards it.
    vec3 normal = dot(shading, way) * dot(facing, way) > 0.0 ? shading : facing;
    bool inside = dot(way, facing) > 0.0;
    float slant = max(sqrt(abs(dot(way, facing))), 0.1);
    vec4 scratched = scratches(place, facing, normal, -way, pixel / slant);
    seen += left * scratched.rgb;
    left *= 1.0 - scratched.a;
    vec3 against = inside ? -normal : normal;
    float cosine = clamp(-dot(way, against), 0.0, 1.0);
    float ratio = inside ? INDEX : 1.0 / INDEX;
    vec2 reflected = fresnel(cosine, ratio);
    if (reflected.x < 1.0) {
      vec3 bent = normalize(ratio * way + (ratio * cosine - reflected.y) * against);
      // Of what is reflected inside only the direction counts that it would leave in at once.
      vec3 mirrored = inside ? reflect(bent, against) : reflect(way, against);
      seen += left * reflected.x * seenAlong(sky, mirrored);
      left *= 1.0 - reflected.x;
      way = bent;
    } else {
      way = reflect(way, against);
    }
    if (left < 0.01) break;
    float distance;
    vec2 corner;
    int triangle = firstTriangle(tree, corners, place, way, NEAREST, distance, corner);
    if (triangle < 0) break;
    vec3 weights = vec3(1.0 - corner.x - corner.y, corner);
    vec3 a = treeTexel(corners, 6 * triangle).xyz;
    vec3 b = treeTexel(corners, 6 * triangle + 1).xyz;
    vec3 c = treeTexel(corners, 6 * triangle + 2).xyz;
    place = weights.x * a + weights.y * b + weights.z * c;
    facing = normalize(cross(b - a, c - a));
    shading = normalize(weights.x * treeTexel(corners, 6 * triangle + 3).xyz
                        + weights.y * treeTexel(corners, 6 * triangle + 4).xyz
                        + weights.z * treeTexel(corners, 6 * triangle + 5).xyz);
  }
  return seen + left * seenAlong(sky, way);
}
