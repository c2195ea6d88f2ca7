// Fur laid in patches: what a shell shows, and its radiance under an even SKY, a lamp along the view
// of radiance HEADLIGHT and one of radiance LAMP.

#include "fur_layer.glsl"

uniform sampler2D photograph;
in vec4 uvsOut;
in vec2 uvThirdOut;
in vec3 weightsOut;
flat in float layerOut;
in vec3 outwardOut;
in vec3 alongOut;
flat in vec3 lampOut;

// Of what is shown so far and of another patch the higher hair; height is that of the one shown.
// A patch's weight counts as so many thicknesses.
vec4 higherHair(vec4 shown, vec2 at, float weight, inout float height) {
  vec4 texel = texture(photograph, at);
  if (weight < 0.02) return shown;
  float here = weight * HEIGHT_OF_WEIGHT - texel.a;
  if (here <= height) return shown;
  height = here;
  return texel;
}

// Kajiya and Kay's fibre with Goldman's backward lobe. All are unit vectors.
float hairLight(vec3 tangent, vec3 light, vec3 view) {
  vec2 cosine = vec2(dot(tangent, light), dot(tangent, view));
  vec2 sine = sqrt(max(vec2(1e-4), 1.0 - cosine * cosine));
  float azimuth = (dot(light, view) - cosine.x * cosine.y) / (sine.x * sine.y);
  return sine.x * (1.0 + 0.5 * clamp(azimuth, -1.0, 1.0));
}

// What a lamp sends to a hair at a depth in the fur, below its own tip, both in lengths of
// attenuation, over what the photograph's light sent there. Along the view all that is seen is lit.
float lampLight(vec3 tangent, vec3 light, vec3 view, vec3 up, float depth, float below) {
  float cosine = dot(light, up), apart = acos(clamp(dot(light, view), -1.0, 1.0));
  float aside = 1.0 - exp(-apart * apart / (HOT_SPOT * HOT_SPOT));
  float slant = 1.0 / max(cosine, 0.05) - 1.0;
  float contrast = CONTRAST + min(SLANT * slant, MOST_SLANT);
  float dim = min(DIM * slant, MOST_DIM) + contrast * (depth - DECAY * MIDDLE);
  float shadow = exp(-BELOW * below - aside * dim);
  float facing = mix(1.0, smoothstep(-DUSK, DUSK, cosine), aside);
  float fibre = hairLight(tangent, light, view) / max(0.4, hairLight(tangent, up, up));
  return pow(fibre, FIBRE) * mix(1.0, ASIDE, aside) * shadow * facing;
}

// Of a highlight on a fibre; its light is reflected into a cone about the fibre.
float glint(vec3 tangent, vec3 light, vec3 view) {
  vec2 cosine = vec2(dot(tangent, light), dot(tangent, view));
  vec2 sine = sqrt(max(vec2(0.0), 1.0 - cosine * cosine));
  return pow(max(0.0, sine.x * sine.y - cosine.x * cosine.y), 40.0);
}

// Heights are drawn further from their mean than brightness tells them, by SPREAD, and a hair stands
// STANDS deep, for it lies rather than stands: below it others are seen, and from aside, as on an
// outline, what is behind it.
vec3 surfaceColour() {
  float height = -10.0;
  vec4 texel = higherHair(vec4(0.0, 0.0, 0.0, 1.0), uvsOut.xy, weightsOut.x, height);
  texel = higherHair(texel, uvsOut.zw, weightsOut.y, height);
  texel = higherHair(texel, uvThirdOut, weightsOut.z, height);
  float own = depthCode(texel.a) / CODES, here = layerOut / LAYERS;
  float below = here - clamp(MIDDLE + SPREAD * (own - MIDDLE), 0.0, 0.999);
  vec3 up = normalize(outwardOut), view = vec3(0.0, 0.0, 1.0);
  float stands = STANDS * mix(EDGE, 1.0, smoothstep(0.0, EDGE_TO, abs(up.z)));
  bool gap = below > max(stands, 1.0 / LAYERS) && layerOut < LAYERS;
  if (own >= 1.0 || below <= 0.0 || gap) discard;
  vec3 tangent = normalize(alongOut * TILT + up);
  // What the uppermost shell shows of a hair is its tip, however far shells are apart; and what is
  // seen on the skin, between shells, is no darker than the foot of a hair.
  float darker = DECAY * clamp(below - 1.0 / LAYERS, 0.0, STANDS), depth = DECAY * own + darker;
  float lamp = lampLight(tangent, lampOut, view, up, depth, darker);
  float lamps = HEADLIGHT * lampLight(tangent, view, view, up, depth, darker) + LAMP * lamp;
  return texel.rgb * (SKY * exp(-BELOW * darker) + lamps)
    + GLOSS * LAMP * lamp * (1.0 - here) * glint(tangent, lampOut, view);
}
