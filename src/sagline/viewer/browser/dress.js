// Changes to the page of viser: sagline.dress(work) calls work whenever the page has changed.
(() => {
  const works = [];
  let due = false;
  const all = () => {
    due = false;
    for (const work of works) work();
  };
  const soon = () => {
    if (!due) requestAnimationFrame(all);
    due = true;
  };
  window.sagline.dress = (work) => {
    works.push(work);
    soon();
  };
  new MutationObserver(soon).observe(document, { subtree: true, childList: true });

  // Send a request, which the server answers to this page only, under "topic-reply".
  let count = 0;
  const page = Math.random().toString(36).slice(2);
  window.sagline.ask = (topic, text, answered) => {
    const name = `${page}-${(count += 1)}`;
    waiting.set(name, answered);
    if (!handled.has(topic)) {
      handled.add(topic);
      window.sagline.on(`${topic}-reply`, ({ to, ...answer }) => {
        waiting.get(to)?.(answer);
        waiting.delete(to);
      });
    }
    window.sagline.send(topic, [name, text]);
  };
  const waiting = new Map(); // handlers of the answers, by the names of the requests
  const handled = new Set(); // topics with a handler
})();
