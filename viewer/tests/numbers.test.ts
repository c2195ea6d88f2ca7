import { expect, it } from "vitest";
import { DataUtils } from "three";
import { widened } from "../src/package/package";
import { shownNumber, withUnits } from "../src/page/elements";

it("halfs are widened as three.js widens them", () => {
  const codes = Uint16Array.from({ length: 1 << 16 }, (_, code) => code);
  const floats = widened(codes);
  for (const code of codes) expect(Object.is(floats[code], DataUtils.fromHalfFloat(code)) || (code & 0x7fff) > 0x7c00).toBe(true);
});

it("numbers are shown with four digits", () => {
  expect(shownNumber(0.123456)).toBe("0.1235");
  expect(shownNumber(24383)).toBe("24,383");
  expect(shownNumber(1e-9)).toBe("1.000e-9");
  expect(withUnits(2.5, "dB")).toBe("2.5 dB");
  expect(withUnits(2.5, "1")).toBe("2.5");
  expect(withUnits(281_000_000, "byte")).toBe("281 MB");
  expect(withUnits(999, "bytes")).toBe("999 bytes");
});
