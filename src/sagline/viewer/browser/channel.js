// window.sagline: messages between page and server, besides those of viser (server.py).
(() => {
  // The reason is given by a server that refuses the page; it is empty if no server answers, and null if one does.
  const showBanner = (reason) => {
    let banner = document.getElementById("sagline-lost");
    if (!banner && reason !== null) {
      banner = document.createElement("div");
      banner.id = "sagline-lost";
      banner.setAttribute("role", "alert");
      document.body.append(banner);
    }
    if (!banner) return;
    banner.hidden = reason === null;
    const lost = "Disconnected. Is sagline view still running? After a new start, open the address that it prints.";
    if (!banner.hidden) banner.textContent = `${reason ? `Not connected: ${reason}` : lost} The page reconnects by itself.`;
  };

  const handlers = new Map(); // handlers by topic
  const latest = new Map(); // last value of each topic, for handlers that are added later
  const topics = new Map(); // topics by the uuid of their elements
  const numbers = new Map(); // labels of hidden numbers by their uuid
  const unsent = new Map(); // last unsent message of each topic
  const early = new Map(); // last unsent value of each hidden number, by label
  let count = 0;
  let worker, uuid; // worker that connects the client to its server; uuid of the field for messages of the page

  let welcome = false; // true if the server accepts messages, that is, after it knows the camera

  const post = (uuid, value) =>
    worker.postMessage({ type: "send", message: { type: "GuiUpdateMessage", uuid, updates: { value } } });
  const flush = () => {
    if (!welcome || uuid === undefined) return;
    for (const [of, label] of numbers) if (early.has(label)) post(of, early.get(label));
    early.clear();
    unsent.forEach((value) => post(uuid, value));
    unsent.clear();
  };
  const deliver = (topic, value) => {
    latest.set(topic, value);
    for (const each of handlers.get(topic) ?? []) each(value);
  };

  window.sagline = {
    // Send a value to the server; before the connection is open, only the last value of a topic is kept.
    send(topic, value) {
      const text = JSON.stringify({ topic, value, count: (count += 1) }); // equal values are sent again
      unsent.delete(topic); // topics are sent in the order of their last values
      unsent.set(topic, text);
      flush();
    },
    // Set a hidden number; before the connection is open, only the last value is kept.
    set(label, value) {
      early.set(label, value);
      flush();
      deliver(`number ${label}`, value);
    },
    // Handle the values of a topic, starting with the last one that has arrived.
    on(topic, handler) {
      handlers.set(topic, [...(handlers.get(topic) ?? []), handler]);
      if (latest.has(topic)) handler(latest.get(topic));
    },
  };

  const receive = (message) => {
    if (message.type === "GuiTextMessage" && message.props.label === "sagline") {
      uuid = message.uuid;
      flush();
    } else if (message.type === "GuiHtmlMessage" && message.props.content.startsWith("sagline:")) {
      topics.set(message.uuid, message.props.content.split(":", 2)[1]);
      content(message.uuid, message.props.content);
    } else if (message.type === "GuiUpdateMessage" && topics.has(message.uuid) && "content" in message.updates) {
      content(message.uuid, message.updates.content);
    } else if (message.type === "GuiNumberMessage" && !message.props.visible) {
      numbers.set(message.uuid, message.props.label);
      deliver(`number ${message.props.label}`, message.value);
    } else if (message.type === "GuiUpdateMessage" && numbers.has(message.uuid) && "value" in message.updates) {
      deliver(`number ${numbers.get(message.uuid)}`, message.updates.value);
    }
  };
  const content = (from, text) => {
    const topic = topics.get(from);
    const json = text.slice(`sagline:${topic}:`.length);
    if (json) deliver(topic, JSON.parse(json));
  };

  window.sagline.on("welcome", () => {
    welcome = true;
    flush();
  });

  let waiting = 0; // timer of the banner from a lost connection to the first message of the next one
  let reason = "";
  window.Worker = class extends window.Worker {
    constructor(...parts) {
      super(...parts);
      worker = this;
      this.addEventListener("message", ({ data }) => {
        if (data?.type === "connected") {
          deliver("connected", true);
        } else if (data?.type === "closed") {
          uuid = undefined; // a restarted server has another field
          numbers.clear();
          welcome = false;
          deliver("connected", false);
          reason = data.closeReason === "Connection closed" ? "" : data.closeReason; // the client's text for no reason
          waiting ||= setTimeout(() => showBanner(reason), 1500); // no banner for a reload or a short interruption
        } else if (data?.type === "message_batch") {
          if (waiting) {
            clearTimeout(waiting);
            waiting = 0;
            showBanner(null);
          }
          data.messages.forEach(receive);
        }
      });
    }
  };
})();
