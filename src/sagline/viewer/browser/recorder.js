// Films from pictures. On pages from this computer or over HTTPS, the browser has an encoder, which encodes each
// picture when it arrives. Otherwise all pictures are stored and played to the browser's recorder at the end.
(() => {
  const { sagline } = window;
  const BITS = 12e6; // bits per second, high because cables are thin
  const AVC = "avc1.42E028"; // H.264 without B-frames, level 4: 1080p at 30 pictures per second
  const KEY = 30; // pictures between two key frames
  const KINDS = ["video/mp4;codecs=avc1.640028", "video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];
  const SLICE = 200; // ms of film in each part from the recorder
  const REST = 500; // repeated drawing of the last picture [ms], because a slow recorder skips pictures

  const painter = (about) => {
    const canvas = Object.assign(document.createElement("canvas"), { width: about.width, height: about.height });
    const context = canvas.getContext("2d", { alpha: false });
    const paint = async ({ blob, clock }) => {
      const picture = await createImageBitmap(blob);
      sagline.compose(context, about, picture, clock);
      picture.close();
    };
    return { canvas, paint };
  };
  const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));

  const encoder = (about, config) => {
    const { canvas, paint } = painter(about);
    const samples = [];
    let described, failure;
    const encoder = new VideoEncoder({
      output: (chunk, { decoderConfig }) => {
        described = decoderConfig ?? described;
        const data = new Uint8Array(chunk.byteLength);
        chunk.copyTo(data);
        samples.push({ data, key: chunk.type === "key" });
      },
      error: (error) => {
        failure = error;
      },
    });
    encoder.configure(config);
    let count = 0;
    return {
      async add(picture) {
        await paint(picture);
        const frame = new VideoFrame(canvas, { timestamp: (1e6 * count) / about.rate, duration: 1e6 / about.rate });
        encoder.encode(frame, { keyFrame: count % KEY === 0 });
        frame.close();
        count += 1;
        while (encoder.encodeQueueSize > 2 && !failure) await nextFrame();
      },
      async finish() {
        await encoder.flush();
        encoder.close();
        if (failure) throw failure;
        return sagline.mp4(about, samples, described);
      },
      stop: () => encoder.state !== "closed" && encoder.close(),
    };
  };

  const recorder = (about, kind) => {
    const pictures = [];
    let stopped = false;
    const { canvas, paint } = painter(about);

    // Show each picture at its time; a slow computer skips pictures.
    const show = async (recorder, at) => {
      let time = 0, last = performance.now(), before = -1;
      const pause = () => {
        if (document.hidden) recorder.pause(); // hidden pages do not draw
        else recorder.resume();
        last = performance.now();
      };
      document.addEventListener("visibilitychange", pause);
      for (; !stopped; await nextFrame()) {
        const now = performance.now();
        if (!document.hidden) time += now - last;
        last = now;
        const due = Math.min(Math.floor((time * about.rate) / 1000), pictures.length - 1);
        if (due === before) continue;
        before = due;
        await paint(pictures[due]);
        at(due + 1);
        if (due === pictures.length - 1) break;
      }
      document.removeEventListener("visibilitychange", pause);
      for (const end = performance.now() + REST; performance.now() < end; await nextFrame()) await paint(pictures.at(-1));
    };
    const fired = (recorder, event) =>
      new Promise((resolve, reject) => {
        recorder.addEventListener(event, resolve, { once: true });
        recorder.addEventListener("error", ({ error }) => reject(error), { once: true });
      });

    return {
      async add(picture) {
        pictures.push(picture);
      },
      async finish(at) {
        await paint(pictures[0]); // otherwise the film begins with a black picture
        const recorder = new MediaRecorder(canvas.captureStream(), { mimeType: kind, videoBitsPerSecond: BITS });
        const parts = [];
        const first = fired(recorder, "dataavailable"), ended = fired(recorder, "stop");
        recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
        recorder.start(SLICE);
        await paint(pictures[0]); // the recorder may have missed the previous drawing
        await first; // the first picture remains until the recorder runs
        await show(recorder, at);
        recorder.stop();
        await ended;
        return new Blob(parts, { type: kind });
      },
      stop() {
        stopped = true;
      },
    };
  };

  // Recorder of a film of pictures { blob, clock }: the better one of the two that this browser supports.
  sagline.filming = async (about) => {
    const { width, height, rate } = about;
    const config = { codec: AVC, width, height, bitrate: BITS, framerate: rate, avc: { format: "avc" } };
    if (window.VideoEncoder && (await VideoEncoder.isConfigSupported(config)).supported) return encoder(about, config);
    const kind = window.MediaRecorder && KINDS.find((each) => MediaRecorder.isTypeSupported(each));
    if (!kind) throw new Error("this browser has no recorder");
    return recorder(about, kind);
  };
})();
