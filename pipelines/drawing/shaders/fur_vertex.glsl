// Fur: a vertex of one of the shells.

in vec2 uv;
in float layer;
out vec2 uvOut;
flat out float layerOut;

void placeVertex() {
  uvOut = uv;
  layerOut = layer;
}
