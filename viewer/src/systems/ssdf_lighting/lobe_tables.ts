/** Tables of a light's matt lobe: `light/cosine_lobes.py`, `distances/edge_share.py`, `stage_view.py`. */

/** Cosines from -1 to 1. */
export const COLUMNS = 513;
/** Steps of the table that a pixel reads. */
export const FINE = 2048;
const NODES = 48;
const REACH = 9;

/** Of N lights; rows are theirs. */
export interface MattTables {
  /** (N, COLUMNS, 4): factors of the light and of the normal that make the axis; 0, 0. */
  axes: Float32Array;
  /** (N, FINE + 1, 4): irradiance / pi, sqrt(1 + sharpness), 1 / share above the horizon; 0. */
  radiance: Float32Array;
}

/** The tables of lights of these sharpnesses. */
export function mattTables(sharpness: ArrayLike<number>): MattTables {
  const count = sharpness.length;
  const axes = new Float32Array(count * COLUMNS * 4);
  const radiance = new Float32Array(count * (FINE + 1) * 4);
  const nodes = legendre(NODES);
  for (let light = 0; light < count; light++) {
    const coarse = new Float64Array(COLUMNS * 3);
    for (let column = 0; column < COLUMNS; column++) {
      const cosine = (2 * column) / (COLUMNS - 1) - 1;
      const lobe = cosineLobe(sharpness[light], cosine, nodes);
      axes.set([lobe.along, lobe.up], 4 * (light * COLUMNS + column));
      const horizon = Math.asin(Math.min(Math.max(lobe.along * cosine + lobe.up, -1), 1));
      const whole = edgeShare(horizon, lobe.sharpness);
      coarse.set([lobe.irradiance / Math.PI, Math.sqrt(1 + lobe.sharpness), 1 / whole], 3 * column);
    }
    for (let fine = 0; fine <= FINE; fine++) {
      const place = (fine / FINE) * (COLUMNS - 1);
      const left = Math.min(Math.floor(place), COLUMNS - 2);
      for (let k = 0; k < 3; k++) {
        const here = coarse[3 * left + k];
        const value = here + (place - left) * (coarse[3 * left + 3 + k] - here);
        radiance[4 * (light * (FINE + 1) + fine) + k] = value;
      }
    }
  }
  return { axes, radiance };
}

interface CosineLobe {
  irradiance: number;
  sharpness: number;
  along: number;
  up: number;
}

/** A Gaussian of amplitude 1 on a matt surface, at a cosine n·p. */
function cosineLobe(sharpness: number, cosine: number, [nodes, weights]: [Float64Array, Float64Array]): CosineLobe {
  const away = Math.acos(cosine);
  const reach = REACH / Math.sqrt(sharpness);
  const last = Math.min(away + reach, Math.PI / 2);
  const first = Math.max(Math.min(away, Math.PI / 2) - reach, 0);
  const across = Math.sqrt(Math.max(1 - cosine * cosine, 0));
  let brightest = -2;
  for (const node of nodes) {
    brightest = Math.max(brightest, Math.cos(first + ((last - first) * (1 + node)) / 2 - away));
  }
  let total = 0;
  let upwards = 0;
  let sideways = 0;
  for (let k = 0; k < nodes.length; k++) {
    const polar = first + ((last - first) * (1 + nodes[k])) / 2;
    const sine = Math.sin(polar);
    const height = Math.cos(polar);
    const faded = Math.exp(sharpness * (Math.cos(polar - away) - brightest));
    const common = ((faded * (last - first)) / 2) * weights[k] * sine * height;
    const around = sharpness * sine * across;
    const zeroth = common * scaledBessel0(around);
    total += zeroth;
    upwards += zeroth * height;
    sideways += common * sine * sine * (around > 1e-8 ? scaledBessel1(around) / around : 0.5);
  }
  sideways *= sharpness;
  const length = Math.hypot(sideways * across, upwards);
  return {
    irradiance: 2 * Math.PI * total * Math.exp(sharpness * (brightest - 1)),
    sharpness: sharpnessOfResultant(length / total),
    along: sideways / length,
    up: (upwards - sideways * cosine) / length,
  };
}

/** λ of the Gaussian whose mean direction is this long: coth λ - 1 / λ. */
function sharpnessOfResultant(length: number): number {
  let sharp = (length * (3 - length ** 2)) / (1 - length ** 2);
  for (let step = 0; step < 6; step++) {
    const steep = Math.sinh(Math.min(sharp, 300));
    const slope = 1 / sharp ** 2 - 1 / steep ** 2;
    sharp -= (1 / Math.tanh(sharp) - 1 / sharp - length) / slope;
  }
  return sharp;
}

/** The visible share of a Gaussian, as `visibleShare` of `sg_visibility.glsl`. */
export function edgeShare(distance: number, sharpness: number): number {
  const size = Math.abs(distance);
  const away = Math.min(size, Math.PI / 2);
  const sine = away * ((0.0076143 * away * away - 0.166051) * away * away + 1);
  const k = Math.sqrt(1 + sharpness);
  const narrow = 1 / k;
  const x = k * Math.sign(distance || 1) * (sine + 0.65 * (size - away));
  const first = ((-0.20853 * narrow - 1.80264) * narrow + 0.07427) * narrow + 1.61209;
  const third = ((-1.83388 * narrow + 1.30114) * narrow - 0.17395) * narrow + 0.05101;
  const logit = x * (first + x * x * (third + x * x * 0.0055));
  return 1 / (1 + Math.exp(-Math.min(Math.max(logit, -80), 80)));
}

/** Nodes and weights of Gauss and Legendre's quadrature on [-1, 1], by Newton's method. */
export function legendre(count: number): [Float64Array, Float64Array] {
  const nodes = new Float64Array(count);
  const weights = new Float64Array(count);
  for (let k = 0; k < count; k++) {
    let x = -Math.cos((Math.PI * (k + 0.75)) / (count + 0.5));
    let slope = 1;
    for (let step = 0; step < 8; step++) {
      let [before, value] = [1, x];
      for (let n = 2; n <= count; n++) [before, value] = [value, ((2 * n - 1) * x * value - (n - 1) * before) / n];
      slope = (count * (x * value - before)) / (x * x - 1);
      x -= value / slope;
    }
    nodes[k] = x;
    weights[k] = 2 / ((1 - x * x) * slope * slope);
  }
  return [nodes, weights];
}

// exp(-x) I0(x) and exp(-x) I1(x), x >= 0: the power series, then the asymptotic one.
const FAR = 14;

/** exp(-x) I0(x). */
export function scaledBessel0(x: number): number {
  return x < FAR ? Math.exp(-x) * series(x, 0) : asymptotic(x, 0);
}

/** exp(-x) I1(x). */
export function scaledBessel1(x: number): number {
  return x < FAR ? Math.exp(-x) * (x / 2) * series(x, 1) : asymptotic(x, 1);
}

/** Sum over k of (x² / 4)^k / (k! (k + order)!). */
function series(x: number, order: number): number {
  const quarter = (x * x) / 4;
  let term = 1;
  let sum = 1;
  for (let k = 1; term > 1e-17 * sum; k++) {
    term *= quarter / (k * (k + order));
    sum += term;
  }
  return sum;
}

/** Hankel's expansion, up to its smallest term. */
function asymptotic(x: number, order: number): number {
  const four = 4 * order * order;
  let term = 1;
  let sum = 1;
  for (let k = 1; k < 30; k++) {
    const next = (-term * (four - (2 * k - 1) ** 2)) / (k * 8 * x);
    if (Math.abs(next) > Math.abs(term) || Math.abs(next) < 1e-17) break;
    term = next;
    sum += term;
  }
  return sum / Math.sqrt(2 * Math.PI * x);
}
