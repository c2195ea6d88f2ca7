// The share of a spherical Gaussian that is visible: it is cut off by a straight edge.
//
// d: angle from the Gaussian's axis to the edge of what is visible, negative outside of it;
// k: sqrt(1 + sharpness). The share's logit is nearly an odd polynomial of k sin(d); the numbers
// are those of pipelines/ssdf_lighting/distances/edge_share.py, where they are explained.
float visibleShare(float d, float k) {
  float size = abs(d), away = min(size, 1.5707963267948966);
  float squared = away * away, narrow = 1.0 / k;
  float sine = away * ((0.0076143 * squared + -0.166051) * squared + 1.0);
  float x = k * (sine + 0.65 * (size - away));
  squared = x * x;
  float first = ((-0.20853 * narrow + -1.80264) * narrow + 0.07427) * narrow + 1.61209;
  float third = ((-1.83388 * narrow + 1.30114) * narrow + -0.17395) * narrow + 0.05101;
  float logit = x * (first + squared * (third + squared * 0.0055));
  logit = min(logit, 80.0);
  return 1.0 / (1.0 + exp(d < 0.0 ? logit : -logit));
}
