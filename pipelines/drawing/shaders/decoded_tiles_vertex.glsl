// Billboards whose textures were decoded before they were sent: one tile each, COLUMNS in a row.

out vec2 placeOut;
flat out vec2 tileOut;

void placeVertex() {
  int number = gl_VertexID / 4, corner = gl_VertexID - 4 * number;
  placeOut = vec2(corner == 1 || corner == 2 ? 1.0 : 0.0, corner > 1 ? 0.0 : 1.0);
  tileOut = vec2(number % COLUMNS, number / COLUMNS);
}
