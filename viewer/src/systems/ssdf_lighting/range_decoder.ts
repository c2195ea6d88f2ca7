/** Whole numbers of an adaptive binary range coder: `compression/entropy_coding.py`, decoded. */

const UNARY = 14;
const QUESTIONS = 2 + UNARY + 31; // zero, sign, sizes, bits of what is over
const HALF = 1 << 15; // of a chance, in 1 / 65536
const FAST = 4;
const SLOW = 7;
const TOP = 1 << 24; // the range is kept at or above
const MOST_BITS = 30;

/**
 * The numbers that `code` was made of, one a context; contexts count from 0. Throws an Error for a
 * code that ends too early.
 */
export function decodeNumbers(code: Uint8Array, contexts: Uint32Array): Int32Array {
  let most = -1;
  for (const context of contexts) most = Math.max(most, context);
  const coder = new RangeDecoder(code, most + 1);
  const values = new Int32Array(contexts.length);
  for (let k = 0; k < values.length; k++) values[k] = coder.number(contexts[k]);
  if (coder.place > code.length) throw new Error(`cut: its code ends after ${code.length} bytes`);
  return values;
}

class RangeDecoder {
  /** Bytes asked for. */
  place = 0;
  private low = 0; // code within the range
  private range = 0xffffffff;
  private readonly chances: Int32Array;

  constructor(
    private readonly code: Uint8Array,
    contexts: number,
  ) {
    this.chances = new Int32Array(contexts * QUESTIONS * 2).fill(HALF);
    for (let k = 0; k < 4; k++) this.low = ((this.low << 8) | this.next()) >>> 0;
  }

  /** The next number, in its context. */
  number(context: number): number {
    const asked = context * QUESTIONS;
    if (!this.told(asked)) return 0;
    const negative = this.told(asked + 1);
    let size = 1;
    while (size <= UNARY && this.told(asked + 1 + size)) size++;
    if (size > UNARY) {
      let bits = 0;
      while (bits < MOST_BITS && this.told(asked + 2 + UNARY + bits)) bits++;
      let rest = 1;
      for (let k = 0; k < bits; k++) rest = rest * 2 + (this.bit(HALF) ? 1 : 0);
      size = UNARY + rest;
    }
    return negative ? -size : size;
  }

  private next(): number {
    return this.place < this.code.length ? this.code[this.place++] : (this.place++, 0);
  }

  private bit(chance: number): boolean {
    const bound = (this.range >>> 16) * chance;
    const is = this.low >= bound;
    if (is) {
      this.low -= bound;
      this.range -= bound;
    } else {
      this.range = bound;
    }
    while (this.range < TOP) {
      this.range = (this.range << 8) >>> 0;
      this.low = ((this.low << 8) | this.next()) >>> 0;
    }
    return is;
  }

  private told(question: number): boolean {
    const { chances } = this;
    const pair = question * 2;
    const chance = Math.min(Math.max((chances[pair] + chances[pair + 1]) >> 1, 32), 65504);
    const is = this.bit(chance);
    if (is) {
      chances[pair] -= chances[pair] >> FAST;
      chances[pair + 1] -= chances[pair + 1] >> SLOW;
    } else {
      chances[pair] += (65536 - chances[pair]) >> FAST;
      chances[pair + 1] += (65536 - chances[pair + 1]) >> SLOW;
    }
    return is;
  }
}
