// Linear light of sRGB codes in [0, 1] (IEC 61966-2-1).
vec3 linearFromSrgb(vec3 codes) {
  return mix(pow((codes + 0.055) / 1.055, vec3(2.4)), codes / 12.92,
    vec3(lessThanEqual(codes, vec3(0.04045))));
}
