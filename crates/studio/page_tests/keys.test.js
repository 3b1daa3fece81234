// What keys mean, and what of it can be switched off.

import assert from "node:assert/strict";
import { test } from "node:test";

import { meaningOf } from "../page/keys.js";

const on = { in_text: false, types: false, characters: true };

test("escape and space stop, with any setting and any modifier", () => {
  for (const characters of [true, false]) {
    for (const ctrlKey of [true, false]) {
      for (const types of [true, false]) {
        assert.equal(meaningOf({ key: "Escape", ctrlKey }, { in_text: types, types, characters }), "stop");
        assert.equal(meaningOf({ key: " ", ctrlKey }, { in_text: false, types, characters }), "stop");
      }
    }
  }
  assert.equal(meaningOf({ key: " " }, { in_text: true, types: true, characters: true }), "none", "a space in a text");
});

test("single-character keys do nothing once they are switched off, and the others still work", () => {
  for (const [key, meaning] of Object.entries({ 1: "view", 9: "view", 0: "own", "?": "help", d: "own", s: "own", r: "own", p: "own", é: "own" })) {
    assert.equal(meaningOf({ key }, on), meaning, key);
    assert.equal(meaningOf({ key }, { ...on, characters: false }), "none", key);
    assert.equal(meaningOf({ key }, { ...on, types: true }), "none", key);
    assert.equal(meaningOf({ key, ctrlKey: true }, on), "none", `Ctrl+${key} is the browser's`);
  }
  for (const key of ["ArrowLeft", "ArrowRight", "Delete", "F1"]) assert.equal(meaningOf({ key }, { ...on, characters: false }), "own", key);
});
