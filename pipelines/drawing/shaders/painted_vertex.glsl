// A surface that shows a colour of its own at each vertex.

in vec3 shown;
out vec3 shownOut;

void placeVertex() {
  shownOut = shown;
}
