// R, G, B of luma and the two chroma differences Y, Co, Cg.
vec3 rgbFromYcocg(vec3 codes) {
  return codes.x + vec3(codes.y - codes.z, codes.z, -codes.y - codes.z);
}
