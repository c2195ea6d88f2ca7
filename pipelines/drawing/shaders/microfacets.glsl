// Beckmann's microfacets: Smith's shadowing as Walter et al. 2007 approximate it, and Fresnel.

// Smith's shadowing of one direction, by its cosine to the normal.
float smith(float cosine, float roughness) {
  float level = sqrt(max(1.0 - cosine * cosine, 1e-12));
  float a = min(max(cosine, 0.0) / (roughness * level), 1.6);
  return min((3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a), 1.0);
}

// The reflectance of a dielectric of this refractive index.
float fresnel(float cosine, float index) {
  float c = clamp(cosine, 1e-6, 1.0);
  float g = sqrt(index * index - 1.0 + c * c);
  float across = (g - c) / (g + c), along = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
  return 0.5 * across * across * (1.0 + along * along);
}

// The refractive index of a dielectric, by its reflectance at normal incidence.
float indexOfSpecular(float specular) {
  return (1.0 + sqrt(specular)) / (1.0 - sqrt(specular));
}
