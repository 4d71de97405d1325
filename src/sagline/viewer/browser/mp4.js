// A film as an MP4 file (ISO/IEC 14496-12 and -15): one track of H.264 in one chunk, with pictures of equal duration.
(() => {
  const big = (length) => (...numbers) => {
    const bytes = new Uint8Array(length * numbers.length);
    numbers.forEach((number, i) => {
      for (let k = 0; k < length; k += 1) bytes[i * length + k] = Math.floor(number / 256 ** (length - 1 - k)) % 256;
    });
    return bytes;
  };
  const u8 = big(1), u16 = big(2), u32 = big(4);
  const letters = (text) => Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const joined = (parts) => {
    const all = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
      all.set(part, at);
      at += part.length;
    }
    return all;
  };
  const box = (type, ...parts) => {
    const content = joined(parts);
    return joined([u32(8 + content.length), letters(type), content]);
  };
  const full = (type, flags, ...parts) => box(type, u32(flags), ...parts); // version 0

  const MATRIX = u32(0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000);
  const TICKS = 1000; // ticks per picture
  const CODES = { bt709: 1, bt470bg: 5, smpte170m: 6, "iec61966-2-1": 13, "bt2020-ncl": 9 }; // ISO/IEC 23091-2

  const entry = ({ width, height }, { description, colorSpace }) => {
    const { primaries, transfer, matrix, fullRange } = colorSpace ?? {};
    const codes = [primaries, transfer, matrix].map((name) => CODES[name] ?? 2); // 2: not specified
    return box(
      "avc1", u16(0, 0, 0, 1), u32(0, 0, 0, 0), u16(width, height), u32(0x480000, 0x480000, 0), u16(1),
      new Uint8Array(32), u16(24, 0xffff),
      box("avcC", new Uint8Array(description)),
      box("colr", letters("nclx"), u16(...codes), u8(fullRange ? 128 : 0)),
    );
  };

  const table = (about, samples, config, offset) => {
    const keys = samples.flatMap(({ key }, i) => (key ? [i + 1] : []));
    return box(
      "stbl",
      full("stsd", 0, u32(1), entry(about, config)),
      full("stts", 0, u32(1, samples.length, TICKS)),
      full("stss", 0, u32(keys.length, ...keys)),
      full("stsc", 0, u32(1, 1, samples.length, 1)),
      full("stsz", 0, u32(0, samples.length), ...samples.map(({ data }) => u32(data.length))),
      full("stco", 0, u32(1, offset)),
    );
  };

  const movie = (about, samples, config, offset) => {
    const { width, height, rate } = about;
    const scale = Math.round(rate * TICKS), length = samples.length * TICKS;
    const header = full("mvhd", 0, u32(0, 0, scale, length, 0x10000), u16(0x100, 0), u32(0, 0), MATRIX, u32(0, 0, 0, 0, 0, 0, 2));
    const track = full("tkhd", 3, u32(0, 0, 1, 0, length, 0, 0), u16(0, 0, 0, 0), MATRIX, u32(width * 65536, height * 65536));
    const media = box(
      "mdia",
      full("mdhd", 0, u32(0, 0, scale, length), u16(0x55c4, 0)), // no language
      full("hdlr", 0, u32(0), letters("vide"), u32(0, 0, 0), u8(0)),
      box(
        "minf",
        full("vmhd", 1, u16(0, 0, 0, 0)),
        box("dinf", full("dref", 0, u32(1), full("url ", 1))),
        table(about, samples, config, offset),
      ),
    );
    return box("moov", header, box("trak", track, media));
  };

  // A file of samples { data, key } in the order of their times; `config` of WebCodecs describes them.
  window.sagline.mp4 = (about, samples, config) => {
    const head = box("ftyp", letters("isom"), u32(512), letters("isomiso2avc1mp41"));
    const before = head.length + movie(about, samples, config, 0).length + 8;
    const size = samples.reduce((sum, { data }) => sum + data.length, 8);
    const parts = [head, movie(about, samples, config, before), u32(size), letters("mdat")];
    return new Blob([...parts, ...samples.map(({ data }) => data)], { type: "video/mp4" });
  };
})();
