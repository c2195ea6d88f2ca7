// Bits of 32-bit words: GLSL ES 3.00 has no built-in functions for them.

int countOnes(uint word) {
  word = word - ((word >> 1) & 0x55555555u);
  word = (word & 0x33333333u) + ((word >> 2) & 0x33333333u);
  word = (word + (word >> 4)) & 0x0F0F0F0Fu;
  return int((word * 0x01010101u) >> 24);
}

// Number of the highest bit that is 1; -1 where there is none.
int highestOne(uint word) {
  word |= word >> 1; word |= word >> 2; word |= word >> 4; word |= word >> 8; word |= word >> 16;
  return countOnes(word) - 1;
}

// Number of the lowest bit that is 1; 32 where there is none.
int lowestOne(uint word) {
  return countOnes((word & (~word + 1u)) - 1u);
}
