// Copies: the text is shown in a dialog, and written to the clipboard if the browser allows it; else it is selected.
(() => {
  const HEADS = { code: "Python code of this state", link: "Link to this state" };

  const copy = async (dialog) => {
    const area = dialog.querySelector("textarea");
    const status = dialog.querySelector("[role=status]");
    area.focus();
    area.select();
    try {
      await navigator.clipboard.writeText(area.value);
      status.textContent = "Copied to the clipboard.";
    } catch {
      const done = document.execCommand("copy"); // pages from other computers have no clipboard interface
      status.textContent = done ? "Copied to the clipboard." : "The browser refuses: copy the selected text.";
    }
  };
  const make = (body, buttons) => {
    body.innerHTML = '<textarea readonly aria-labelledby="sagline-copy-head"></textarea><p role="status"></p>';
    buttons.innerHTML = '<button type="button">Copy</button>';
    buttons.firstChild.addEventListener("click", () => copy(body.closest("dialog")));
  };
  const show = (what, text) => {
    const dialog = window.sagline.dialog("copy", HEADS[what], make);
    const area = dialog.querySelector("textarea");
    area.value = what === "link" ? window.sagline.linked(text) : text;
    area.rows = Math.min(Math.max(text.split("\n").length, 2), 24);
    area.classList.toggle("wrapped", what === "link");
    area.scrollTop = 0;
    copy(dialog);
  };

  document.addEventListener("click", ({ target }) => {
    const what = target.closest?.("[data-copy]")?.dataset.copy;
    if (!what) return;
    window.sagline.ask("copy", what, ({ text, refused }) => (refused ? window.sagline.refuse(refused) : show(what, text)));
  });
})();
