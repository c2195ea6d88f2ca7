// Fresnel's reflectance by Schlick's approximation: base is that at normal incidence.
float schlick(float base, float cosine) {
  return base + (1.0 - base) * pow(1.0 - cosine, 5.0);
}
