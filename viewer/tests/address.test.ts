import { expect, it } from "vitest";
import { read, written } from "../src/page/address";

it("an address holds a view, to five digits", () => {
  const camera = { position: [1.23456789, 0, -2], target: [0, 0, 0], up: [0, 0, 1], view_angle: 30, height: null };
  const fragment = written({ key: "photo_fur/fur_package/teapot.grass", view: { camera, state: { on: true } } as never });
  expect(fragment.startsWith("#package=")).toBe(true);
  const { key, view } = read(fragment);
  expect(key).toBe("photo_fur/fur_package/teapot.grass");
  expect(view?.camera?.position).toEqual([1.2346, 0, -2]);
  expect(view?.state).toEqual({ on: true });
});

it("an address without anything is the first page", () => {
  expect(read("")).toEqual({ key: undefined });
  expect(read("#gallery")).toEqual({ key: undefined });
});

it("a view that is no JSON is named", () => {
  expect(() => read("#package=a&view={")).toThrow("address: view is no JSON");
});
