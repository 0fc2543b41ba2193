// What was told, in the order of steps, and what is shown of it at one of them. Lengths in metres about the middle of the
// map, angles in degrees.

const TYPES = {u8: Uint8Array, i8: Int8Array, i16: Int16Array, u16: Uint16Array, u32: Uint32Array, f32: Float32Array};
const MOST = {states: 9000, maps: 400, surfaces: 100}; // of longer sessions every second one is forgotten

/** Arrays come as {"u8": base64}, with "unit" where they are whole multiples of it. */
function array(told) {
  const kind = Object.keys(TYPES).find((each) => each in told);
  const text = atob(told[kind]);
  const bytes = Uint8Array.from(text, (each) => each.charCodeAt(0));
  const values = new TYPES[kind](bytes.buffer);
  return told.unit ? Float32Array.from(values, (each) => each * told.unit) : values;
}

/** Whatever is an array, at any depth. */
function decoded(told) {
  if (told === null || typeof told !== "object") return told;
  if (Array.isArray(told)) return told.map(decoded);
  if (Object.keys(TYPES).some((each) => each in told)) return array(told);
  return Object.fromEntries(Object.entries(told).map(([name, each]) => [name, decoded(each)]));
}

class Recorded {
  constructor() { this.forget(); }

  forget() {
    this.scene = this.truth = this.end = null;
    this.states = []; this.maps = []; this.surfaces = [];
  }

  /** Takes in a line; returns its kind. */
  take(line) {
    const told = JSON.parse(line);
    if (told.kind === "scene") { this.forget(); this.scene = decoded(told); }
    else if (told.kind === "truth") this.truth = decoded(told);
    else if (told.kind === "end") this.end = told;
    else this.insert(this[told.kind + "s"], told, MOST[told.kind + "s"]);
    return told.kind;
  }

  /** Surfaces take a while, and come after what is younger. */
  insert(list, told, most) {
    let place = list.length;
    while (place > 0 && list[place - 1].step > told.step) place--;
    if (place > 0 && list[place - 1].step === told.step) list[place - 1] = told;
    else list.splice(place, 0, told);
    if (list.length > most) {
      const kept = list.filter((_, index) => index % 2 === 0 || index > list.length - 3);
      list.splice(0, list.length, ...kept);
    }
  }

  /** The last of a list that was there at a step, its arrays made when they are first looked at; null: none was. */
  at(list, step) {
    let low = 0, high = list.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (list[middle].step <= step) low = middle + 1; else high = middle;
    }
    if (low === 0) return null;
    const found = list[low - 1];
    if (!found.ready) { Object.assign(found, decoded(found)); found.ready = true; }
    return found;
  }
}
