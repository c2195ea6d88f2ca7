// A surface that shows a colour of its own at each vertex, interpolated.

in vec3 shownOut;

vec3 surfaceColour() {
  return shownOut;
}
