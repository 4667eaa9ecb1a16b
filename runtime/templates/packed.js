// Numbers that are packed in the page: compressed, in Base64.
"use strict";
const pinnrayPacked = (() => {
  async function unpacked(name) {
    const text = document.getElementById(name).textContent.trim();
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
  }

  // A function that gives the array at a place; one in steps of its range, low bytes first, as values.
  const kinds = {
    float64: Float64Array, float32: Float32Array, uint32: Uint32Array, uint16: Uint16Array, uint8: Uint8Array,
  };
  async function reader(name) {
    const buffer = await (await unpacked(name)).arrayBuffer();
    return (place) => {
      const raw = new kinds[place.kind](buffer, place.offset, place.length);
      if (place.step === undefined) return raw;
      const count = raw.length / 2;
      const value = (_, k) => place.low + place.step * (raw[k] + 256 * raw[count + k]);
      return Float64Array.from({ length: count }, value);
    };
  }

  return { reader };
})();
