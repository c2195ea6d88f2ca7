// The gloss of rough dielectrics under spherical Gaussians.

#include "microfacets.glsl"
#include "sg_visibility.glsl"

// A material as seen from one direction, view; its gloss is nearly a Gaussian about towards.
struct Gloss {
  vec3 view;
  vec3 towards;
  vec2 lobe;       // sharpness, ln(amplitude)
  float roughness;
  float index;
  float constant;  // of the reflectance: all that does not depend on the light
};

// fitted: of the material's table, for this view: sharpness, two factors that give the axis (along
// the mirrored view, along the normal), ln(amplitude). seen: the view's cosine, not too small.
Gloss glossOf(vec4 fitted, vec3 normal, vec3 view, float facing, float seen, float roughness,
              float specular) {
  vec3 towards = normalize(fitted.y * (2.0 * facing * normal - view) + fitted.z * normal);
  float constant = smith(seen, roughness) / (12.56637061 * roughness * roughness * seen);
  return Gloss(view, towards, fitted.xw, roughness, indexOfSpecular(specular), constant);
}

// The radiance under one light of amplitude 1, (axis, sharpness), at an angular distance d from
// the edge of what is visible. The Gaussian is corrected by the reflectance itself where its
// product with the light has its axis.
float glossRadiance(Gloss gloss, vec4 light, float d, vec3 normal) {
  float sharpness = gloss.lobe.x, level = gloss.lobe.y, roughness = gloss.roughness;
  vec3 joined = sharpness * gloss.towards + light.w * light.xyz;
  float sharp = length(joined);
  vec3 axis = joined / sharp;
  float height = dot(axis, normal);
  vec3 halfway = normalize(axis + gloss.view);
  float squared = dot(halfway, normal);
  squared = max(squared * squared, 1e-12);
  float rest = gloss.constant * smith(height, roughness)
    * fresnel(dot(halfway, gloss.view), gloss.index) / (squared * squared);
  float truth = max(
    log(max(rest, 1e-30)) + (1.0 - 1.0 / squared) / (roughness * roughness), -69.0);
  vec3 apart = gloss.towards - light.xyz, off = axis - gloss.towards;
  float lost = sharpness * light.w * dot(apart, apart) / (sharp + sharpness + light.w);
  float fit = level - 0.5 * sharpness * dot(off, off);
  float narrow = light.w / (light.w + sharpness);
  float value = exp(level - lost + narrow * (truth - fit))
    * (1.0 - exp(-2.0 * sharp)) * 6.28318531 / sharp;
  float k = sqrt(1.0 + sharp);
  float share = visibleShare(d, k) / max(visibleShare(asin(clamp(height, -1.0, 1.0)), k), 1e-3);
  return height > 0.0 ? value * min(share, 1.0) : 0.0;
}
