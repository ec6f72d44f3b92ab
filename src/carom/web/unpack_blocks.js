// Unpacks the blocks of the page and starts the page's script. A block is text of 91 different characters. Two
// characters encode 13 bits. The bits contain the length of the content in four bytes, the Adler-32 of the content in
// four bytes, and an LZMA stream without header. A block is a fifth smaller than in formats that browsers can unpack.
// Igor Pavlov, "LZMA specification" (2015), defines the stream. The parameters of the stream are in carom/web/page.py.
const LITERAL_BITS = 3,
  PLACES = { match: 0, rep: 12, rep0: 24, rep1: 36, rep2: 48, long: 60, slot: 72, far: 328, align: 443, lengths: 459, repeats: 733, literals: 1007 };
function bytesOf(text) {
  const bytes = new Uint8Array(Math.ceil((text.length * 13) / 16)),
    digit = (k) => (text.charCodeAt(k) === 33 ? 60 : text.charCodeAt(k)) - 35;
  let held = 0,
    bits = 0,
    count = 0;
  for (let k = 0; k < text.length; k += 2)
    for (held |= (digit(k) + 91 * digit(k + 1)) << bits, bits += 13; bits >= 8; held >>>= 8, bits -= 8) bytes[count++] = held;
  return bytes;
}
const DAMAGED = "this page is damaged: a part of its data has changed";
function adler32(bytes) {
  let low = 1,
    high = 0;
  for (const byte of bytes) {
    low = (low + byte) % 65521;
    high = (high + low) % 65521;
  }
  return high * 65536 + low;
}
function unpacked(bytes) {
  const { match, rep, rep0, rep1, rep2, long, slot, far, align, lengths, repeats, literals } = PLACES,
    header = new DataView(bytes.buffer),
    out = new Uint8Array(header.getUint32(0, true)),
    odds = new Uint16Array(literals + (0x300 << LITERAL_BITS)).fill(1024);
  let at = 13,
    range = 0xffffffff,
    code = header.getUint32(9),
    state = 0,
    count = 0,
    last = [0, 0, 0, 0]; // the last four distances, each minus 1
  const narrow = () => {
    if (range >= 0x1000000) return;
    if (at >= bytes.length) throw new RangeError(DAMAGED); // with damaged data, the loop might never end
    range = (range << 8) >>> 0;
    code = ((code << 8) | bytes[at++]) >>> 0;
  };
  const bit = (place) => {
    const odd = odds[place],
      bound = (range >>> 11) * odd,
      isOne = code >= bound;
    if (isOne) {
      range -= bound;
      code -= bound;
      odds[place] -= odd >>> 5;
    } else {
      range = bound;
      odds[place] += (2048 - odd) >>> 5;
    }
    narrow();
    return Number(isOne);
  };
  const number = (place, bits) => {
    let found = 1;
    for (let k = 0; k < bits; k++) found = (found << 1) | bit(place + found);
    return found - (1 << bits);
  };
  const reversed = (place, bits) => {
    let found = 0;
    for (let k = 0, node = 1; k < bits; k++) {
      const one = bit(place + node);
      node = (node << 1) | one;
      found |= one << k;
    }
    return found;
  };
  const evenly = (bits) => {
    let found = 0;
    for (let k = 0; k < bits; k++) {
      range >>>= 1;
      const isOne = code >= range;
      if (isOne) code -= range;
      found = (found << 1) | Number(isOne);
      narrow();
    }
    return found;
  };
  const length = (place) => {
    if (!bit(place)) return number(place + 2, 3);
    return bit(place + 1) ? 16 + number(place + 18, 8) : 8 + number(place + 10, 3);
  };
  const distance = (size) => {
    const found = number(slot + 64 * Math.min(size, 3), 6);
    if (found < 4) return found;
    const bits = (found >> 1) - 1,
      base = (2 | (found & 1)) << bits;
    return found < 14 ? base + reversed(far + base - found, bits) : base + 16 * evenly(bits - 4) + reversed(align, 4);
  };
  const literal = () => {
    const place = literals + 0x300 * ((count && out[count - 1]) >> (8 - LITERAL_BITS));
    let found = 1;
    if (state >= 7)
      for (let other = out[count - last[0] - 1], same = 1; same && found < 256; other <<= 1) {
        const expected = (other >> 7) & 1,
          one = bit(place + ((1 + expected) << 8) + found);
        found = (found << 1) | one;
        same = Number(one === expected);
      }
    while (found < 256) found = (found << 1) | bit(place + found);
    return found;
  };
  const copy = (size) => {
    for (let k = 0; k < size; k++, count++) out[count] = out[count - last[0] - 1];
  };
  while (count < out.length) {
    if (!bit(match + state)) {
      out[count] = literal();
      count++;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
    } else if (!bit(rep + state)) {
      const size = length(lengths);
      last = [distance(size), ...last.slice(0, 3)];
      state = state < 7 ? 7 : 10;
      copy(size + 2);
    } else {
      let which = 0;
      if (bit(rep0 + state)) which = bit(rep1 + state) ? 2 + bit(rep2 + state) : 1;
      else if (!bit(long + state)) {
        state = state < 7 ? 9 : 11;
        copy(1);
        continue;
      }
      last = [last[which], ...last.filter((_, k) => k !== which)];
      const size = length(repeats);
      state = state < 7 ? 8 : 11;
      copy(size + 2);
    }
  }
  if (adler32(out) !== header.getUint32(4, true)) throw new RangeError(DAMAGED);
  return out;
}

globalThis.caromUnpacked = (element) => unpacked(bytesOf(element.textContent.trim()));
globalThis.caromText = (element) => new TextDecoder().decode(globalThis.caromUnpacked(element));
const style = document.createElement("style");
style.textContent = globalThis.caromText(document.getElementById("style"));
document.head.append(style);
const script = document.createElement("script");
script.type = "module";
// the page's policy allows the hash of this text
script.textContent = globalThis.caromText(document.getElementById("page"));
document.head.append(script);
