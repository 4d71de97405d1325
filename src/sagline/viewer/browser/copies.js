// What is copied: shown in a dialog, and put onto the clipboard where the browser lets us; else the text is selected.
(() => {
  const HEADS = { code: "Python code of this state", link: "Link to this state" };

  const copy = async (dialog) => {
    const area = dialog.querySelector("textarea");
    const told = dialog.querySelector("[role=status]");
    area.focus();
    area.select();
    try {
      await navigator.clipboard.writeText(area.value);
      told.textContent = "Copied to the clipboard.";
    } catch {
      const done = document.execCommand("copy"); // where there is no clipboard: on a page that is not of this machine
      told.textContent = done ? "Copied to the clipboard." : "The browser refuses: copy the selected text.";
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
