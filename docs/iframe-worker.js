/* Search in pages that are opened from the disk, where browsers refuse workers: a hidden frame runs the worker's script.
   The name of this file keeps the builder from loading one of the same kind from another server. */
"use strict";

if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      const inner = frame.contentWindow;
      inner.document.open();
      inner.postMessage = (data) => {
        const event = new MessageEvent("message", { data });
        this.dispatchEvent(event);
        this.onmessage?.(event);
      };
      this.loaded = new Promise((resolve) => { inner.onload = resolve; });
      inner.document.write(`<body><script src="${url}"></` + "script></body>");
      inner.document.close();
      this.frame = frame;
    }

    postMessage(data) {
      this.loaded.then(() => this.frame.contentWindow.dispatchEvent(new MessageEvent("message", { data })));
    }

    terminate() {
      this.frame.remove();
    }
  };
}
