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
  if (weight < 0.02) return shown;
  vec4 texel = texture(photograph, at);
  float here = weight * HEIGHT_OF_WEIGHT - texel.a;
  if (here <= height) return shown;
  height = here;
  return texel;
}

// Kajiya and Kay's fibre with Goldman's backward lobe, over what it sends straight up under light
// from straight above. All are unit vectors.
float hairLight(vec3 tangent, vec3 light, vec3 view) {
  vec2 cosine = vec2(dot(tangent, light), dot(tangent, view));
  vec2 sine = sqrt(max(vec2(1e-4), 1.0 - cosine * cosine));
  float azimuth = (dot(light, view) - cosine.x * cosine.y) / (sine.x * sine.y);
  return sine.x * (1.0 + 0.3 * clamp(azimuth, -1.0, 1.0));
}

// What the fur above a shell lets through, over what it lets through from straight above; cosine of
// the light to the surface's normal, depth in lengths of attenuation.
float shadow(float cosine, float depth) {
  return exp(-depth * (1.0 / max(cosine, 0.2) - 1.0)) * smoothstep(-0.35, 0.25, cosine);
}

// Of a highlight on a fibre; its light is reflected into a cone about the fibre.
float glint(vec3 tangent, vec3 light, vec3 view) {
  vec2 cosine = vec2(dot(tangent, light), dot(tangent, view));
  vec2 sine = sqrt(max(vec2(0.0), 1.0 - cosine * cosine));
  return pow(max(0.0, sine.x * sine.y - cosine.x * cosine.y), 40.0);
}

vec3 surfaceColour() {
  float height = -10.0;
  vec4 texel = higherHair(vec4(0.0, 0.0, 0.0, 1.0), uvsOut.xy, weightsOut.x, height);
  texel = higherHair(texel, uvsOut.zw, weightsOut.y, height);
  texel = higherHair(texel, uvThirdOut, weightsOut.z, height);
  vec4 hair = hairInLayer(texel, layerOut, CODE_STEPS, DECAY, true);
  if (hair.a == 0.0) discard;
  vec3 up = normalize(outwardOut), view = vec3(0.0, 0.0, 1.0);
  float over = 1.0 - layerOut / LAYERS, depth = DECAY * layerOut;
  vec3 tangent = normalize(alongOut * (0.4 + 1.2 * over) + up);
  float open = shadow(dot(lampOut, up), depth);
  float lamps = HEADLIGHT * hairLight(tangent, view, view) * shadow(dot(view, up), depth)
    + LAMP * hairLight(tangent, lampOut, view) * open;
  float above = hairLight(tangent, up, up);
  return hair.rgb * (SKY * (0.5 + 0.5 * over) + lamps / above)
    + GLOSS * LAMP * open * over * glint(tangent, lampOut, view);
}
