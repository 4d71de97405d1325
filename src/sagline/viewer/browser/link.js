// State in a link, after the number sign: it is sent to the server once and removed from the address.
(() => {
  // The address consists of the host and the token. viser's client would write the address of its server behind it, and
  // would connect to any other server that stands there.
  const replace = history.replaceState.bind(history);
  history.replaceState = () => replace(null, "", location.pathname);

  const DEFAULT = "Readings"; // open tab if a link does not name a tab
  const open = () =>
    [...document.querySelectorAll('[role=tab][aria-selected="true"]')]
      .map((tab) => tab.textContent.trim())
      .filter((name) => name && name !== DEFAULT);

  window.sagline.linked = (text) => {
    const tabs = open().map((name) => `&tab=${encodeURIComponent(name)}`);
    return `${location.origin}${location.pathname}#${text}${tabs.join("")}`;
  };

  let pending = []; // tabs to open, which may not exist yet
  const show = () => {
    pending = pending.filter((name) => {
      const tab = [...document.querySelectorAll("[role=tab]")].find((each) => each.textContent.trim() === name);
      if (!tab) return true;
      for (const kind of ["pointerdown", "mousedown", "pointerup", "mouseup", "click"]) {
        tab.dispatchEvent(new (kind.startsWith("pointer") ? PointerEvent : MouseEvent)(kind, { bubbles: true, button: 0 }));
      }
      return false;
    });
  };
  const apply = () => {
    const hash = location.hash.slice(1);
    history.replaceState(); // a reload does not apply the link again
    if (!hash.includes("=")) return;
    const parts = hash.split("&");
    const tabs = parts.filter((part) => part.startsWith("tab=")).map((part) => part.slice(4));
    window.sagline.ask("link", parts.filter((part) => !part.startsWith("tab=")).join("&"), ({ refused }) => {
      window.sagline.refuse(refused ?? "");
      if (refused) return;
      pending = tabs.slice(0, 5).map((name) => {
        try {
          return decodeURIComponent(name);
        } catch {
          return ""; // invalid text
        }
      });
      show();
    });
  };
  window.sagline.dress(() => {
    if (pending.length) show();
  });
  window.addEventListener("hashchange", apply);
  apply();
})();
