// Parses a block of docs/viewer_data.md: a JSON head followed by binary arrays.
"use strict";

Evalbus.Block = class {
  // Throws Error if the bytes are not a valid block.
  constructor(buffer) {
    if (buffer.byteLength < 4) throw new Error("a block has less than four bytes");
    const length = new DataView(buffer).getUint32(0, true);
    if (4 + length > buffer.byteLength) throw new Error("the head of a block is truncated");
    this.head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    this.kind = this.head.block;
    this.buffer = buffer;
    this.begin = Math.ceil((4 + length) / 8) * 8;
  }

  has(name) {
    return Boolean(this.head.arrays && this.head.arrays[name]);
  }

  shape(name) {
    return this.head.arrays[name].shape;
  }

  // Returns the array with differences summed up, but without scale and origin.
  raw(name) {
    const { type, shape, offset, delta } = this.head.arrays[name];
    const Type = Evalbus.Block.TYPES[type];
    const count = shape.reduce((product, size) => product * size, 1);
    if (!Type || this.begin + offset + count * Type.BYTES_PER_ELEMENT > this.buffer.byteLength) {
      throw new Error(`array ${name} of a block is truncated`);
    }
    const values = new Type(this.buffer, this.begin + offset, count);
    if (!delta) return values;
    const sums = new Type(values);
    const row = shape[shape.length - 1];
    for (let i = 1; i < count; ++i) {
      if (i % row !== 0) sums[i] += sums[i - 1];
    }
    return sums;
  }

  // Returns the decoded values of an array. Scale and origin are single numbers, or one number per element of the last axis.
  values(name) {
    const { shape, scale = 1, origin = 0 } = this.head.arrays[name];
    const raw = this.raw(name);
    if (raw instanceof Float32Array && scale === 1 && origin === 0) return raw;
    const row = shape[shape.length - 1];
    const scales = Array.isArray(scale) ? scale : null, origins = Array.isArray(origin) ? origin : null;
    const values = new Float32Array(raw.length);
    for (let i = 0; i < raw.length; ++i) {
      values[i] = (origins ? origins[i % row] : origin) + (scales ? scales[i % row] : scale) * raw[i];
    }
    return values;
  }
};

Evalbus.Block.TYPES = {
  u8: Uint8Array, i16: Int16Array, u16: Uint16Array, i32: Int32Array, u32: Uint32Array, f32: Float32Array,
};
