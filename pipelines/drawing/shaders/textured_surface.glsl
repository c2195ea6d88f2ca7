// Materials with textures: what a pixel shows of them.
//
// As pipelines/ssdf_lighting/surface_textures.py, whose Sampler and bent_normals say the same.

struct Look {
  vec3 normal;
  vec3 albedo;
  vec3 tint;        // of the gloss
  float specular;   // F0
  float roughness;  // Beckmann's slope
};

Look lookOf(vec3 normal, vec3 base, float metal, vec3 specular, float roughness) {
  float rest = clamp(1.0 - metal, 0.0, 1.0);
  vec3 reflected = specular * rest + base * metal;
  float mean = dot(reflected, vec3(1.0 / 3.0));
  vec3 tint = mean > 1e-6 ? reflected / mean : vec3(1.0);
  float slope = min(roughness * roughness, 1.0);
  return Look(normal, clamp(base * rest, 0.0, 1.0), tint, max(mean, 0.0), slope);
}

// A unit normal with the bump of a texture, which is along u, along v and along the normal: u is
// the triangle's own, turned into the plane of the normal. one, other: two ways in the triangle;
// first, second: the same in texture coordinates.
vec3 bentNormal(vec3 normal, vec3 bump, vec3 one, vec3 other, vec2 first, vec2 second) {
  float area = first.x * second.y - first.y * second.x;
  vec3 along = sign(area) * (one * second.y - other * first.y);
  vec3 across = sign(area) * (other * first.x - one * second.x);
  along -= dot(along, normal) * normal;
  along /= max(length(along), 1e-30);
  vec3 side = cross(normal, along);
  side *= dot(side, across) < 0.0 ? -1.0 : 1.0;
  vec3 bent = along * bump.x + side * bump.y + normal * bump.z;
  float size = length(bent);
  return area != 0.0 && size > 1e-6 ? bent / size : normal;
}

// Bumps that are too small for a pixel make the gloss rougher: their mean is shorter than 1.
float roughenedSlope(float slope, float size, float bend) {
  float spread = max(0.98 - size, 0.0) / max(size, 0.1);
  return min(sqrt(slope * slope + 2.0 * bend * bend * spread), 1.0);
}
