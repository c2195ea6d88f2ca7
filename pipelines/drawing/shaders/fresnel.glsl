// Fresnel's reflectance of light that is not polarised, and the cosine behind the surface; ratio is
// the index in front over the index behind. Total reflection gives 1 and 0.
vec2 fresnel(float cosine, float ratio) {
  float sine2 = ratio * ratio * (1.0 - cosine * cosine);
  if (sine2 >= 1.0) return vec2(1.0, 0.0);
  float behind = sqrt(1.0 - sine2);
  float along = (ratio * cosine - behind) / (ratio * cosine + behind);
  float across = (cosine - ratio * behind) / (cosine + ratio * behind);
  return vec2(0.5 * (along * along + across * across), behind);
}
