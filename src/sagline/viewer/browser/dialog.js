// Dialogs: sagline.dialog(name, head, make) opens and returns a dialog, which is created at its first use.
(() => {
  window.sagline.dialog = (name, head, make) => {
    let dialog = document.getElementById(`sagline-${name}`);
    if (!dialog) {
      dialog = document.createElement("dialog");
      dialog.id = `sagline-${name}`;
      dialog.className = "sagline sagline-dialog";
      dialog.setAttribute("aria-labelledby", `sagline-${name}-head`);
      dialog.innerHTML =
        `<h2 id="sagline-${name}-head"></h2><div></div>` +
        '<form method="dialog"><span></span><button>Close</button></form>';
      make(dialog.querySelector("div"), dialog.querySelector("span"));
      document.body.append(dialog);
    }
    dialog.querySelector("h2").textContent = head;
    if (!dialog.open) dialog.showModal();
    return dialog;
  };
})();
