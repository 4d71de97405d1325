// Pictures that the server requests stay on this page; the server always receives a single pixel instead. It refuses
// large messages, so a picture sent after a film is canceled would end the connection.
// A picture for print (features/export.py) is saved at once, with its dots per inch.
(() => {
  const PIXEL =
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==";
  const pixel = () => Uint8Array.from(atob(PIXEL), (character) => character.charCodeAt(0));
  let keeper; // function that is called with each picture (a blob); its promise ends when the picture is processed

  window.Worker = class extends window.Worker {
    postMessage(data, ...rest) {
      const { message } = data ?? {};
      if (message?.type === "GetRenderResponseMessage" && message.payload.length) this.keep(data);
      else super.postMessage(data, ...rest);
    }
    async keep(data) {
      await keeper?.(new Blob([data.message.payload])); // the next picture is requested after this one is processed
      super.postMessage({ ...data, message: { ...data.message, payload: pixel() } });
    }
  };
  // Set the function that keeps the pictures, or no function.
  window.sagline.keep = (handler) => {
    keeper = handler;
  };
  window.sagline.save = (blob, name) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000); // a browser may first ask for the folder
  };

  const crc = (bytes) => {
    let sum = ~0;
    for (const byte of bytes) {
      sum ^= byte;
      for (let k = 0; k < 8; k += 1) sum = sum & 1 ? (sum >>> 1) ^ 0xedb88320 : sum >>> 1;
    }
    return ~sum >>> 0;
  };
  // PNG with its size on paper: a chunk pHYs with dots per meter after the header.
  const sized = async (png, dots) => {
    const chunk = new DataView(new ArrayBuffer(21));
    const each = Math.round(dots / 0.0254);
    chunk.setUint32(0, 9);
    [..."pHYs"].forEach((letter, i) => chunk.setUint8(4 + i, letter.charCodeAt(0)));
    chunk.setUint32(8, each);
    chunk.setUint32(12, each);
    chunk.setUint8(16, 1);
    chunk.setUint32(17, crc(new Uint8Array(chunk.buffer, 4, 13)));
    const head = 33; // signature and IHDR
    return new Blob([png.slice(0, head), chunk.buffer, png.slice(head)], { type: "image/png" });
  };

  window.sagline.on("picture", (about) => {
    if (!about) return window.sagline.keep(undefined);
    window.sagline.keep(async (blob) => {
      window.sagline.keep(undefined);
      const canvas = Object.assign(document.createElement("canvas"), { width: about.width, height: about.height });
      window.sagline.compose(canvas.getContext("2d"), about, await createImageBitmap(blob));
      canvas.toBlob(async (png) => window.sagline.save(await sized(png, about.dots), `${about.name}.png`), "image/png");
    });
  });
})();
