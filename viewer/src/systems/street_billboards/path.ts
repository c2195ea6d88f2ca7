/** The way that was driven: places along it, and where something stands beside it. */

import { Vector3 } from "three";

/** A place as the road sees it: metres along the way, to its left, and above it. */
export interface RoadPlace {
  along: number;
  left: number;
  above: number;
}

/** A way through places in the world, z up. */
export class Path {
  readonly places: Vector3[];
  /** Metres from its beginning, of each place. */
  readonly along: number[] = [0];

  /** poses (f, 4, 4), row by row. */
  constructor(poses: Float32Array) {
    const count = poses.length / 16;
    this.places = Array.from({ length: count }, (_, frame) => {
      const at = 16 * frame;
      return new Vector3(poses[at + 3], poses[at + 7], poses[at + 11]);
    });
    for (let frame = 1; frame < count; frame++) {
      this.along.push(this.along[frame - 1] + this.places[frame].distanceTo(this.places[frame - 1]));
    }
  }

  /** Metres. */
  get length(): number {
    return this.along[this.along.length - 1];
  }

  /** A place on the way; before its beginning and after its end it goes straight on. */
  at(along: number): Vector3 {
    const [from, to, part] = this.between(along);
    return from.clone().lerp(to, part);
  }

  /** The azimuth of the way, radians: turned smoothly from stretch to stretch. */
  azimuth(along: number): number {
    const reach = 1.5;
    const ahead = this.at(along + reach).sub(this.at(along - reach));
    return Math.atan2(ahead.y, ahead.x);
  }

  /** Where something stands beside the way, by the nearest place on it. */
  beside(position: readonly number[]): RoadPlace {
    const point = new Vector3(...position);
    let [best, along] = [Infinity, 0];
    for (let frame = 1; frame < this.places.length; frame++) {
      const [from, to] = [this.places[frame - 1], this.places[frame]];
      const step = to.clone().sub(from);
      const part = step.lengthSq() ? point.clone().sub(from).dot(step) / step.lengthSq() : 0;
      const kept = Math.min(Math.max(part, 0), 1);
      const distance = from.clone().addScaledVector(step, kept).distanceTo(point);
      if (distance < best) [best, along] = [distance, this.along[frame - 1] + kept * step.length()];
    }
    const offset = new Vector3();
    let azimuth = 0;
    // To where the smooth way is straight below: who drives on beside a bend stays beside it.
    for (let step = 0; step < 6; step++) {
      azimuth = this.azimuth(along);
      offset.copy(point).sub(this.at(along));
      const ahead = Math.cos(azimuth) * offset.x + Math.sin(azimuth) * offset.y;
      if (along + ahead < 0 || along + ahead > this.length || Math.abs(ahead) < 1e-6) break;
      along += ahead;
    }
    return { along, left: -Math.sin(azimuth) * offset.x + Math.cos(azimuth) * offset.y, above: offset.z };
  }

  /** The place in the world. */
  world({ along, left, above }: RoadPlace): Vector3 {
    const azimuth = this.azimuth(along);
    return this.at(along).add(new Vector3(-Math.sin(azimuth) * left, Math.cos(azimuth) * left, above));
  }

  private between(along: number): [Vector3, Vector3, number] {
    const { places } = this;
    if (places.length === 1) return [places[0], places[0], 0];
    let frame = this.along.findIndex((reached, number) => number > 0 && reached >= along);
    if (frame < 0) frame = places.length - 1;
    const step = this.along[frame] - this.along[frame - 1];
    return [places[frame - 1], places[frame], step ? (along - this.along[frame - 1]) / step : 0];
  }
}
