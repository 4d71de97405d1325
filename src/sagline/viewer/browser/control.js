// Tab of the bottom sheet of small screens that shows the controls without the readings above them.
(() => {
  const SHEET = '[style*="position: fixed"][style*="width: 20em"]';
  window.sagline.dress(() => {
    const tabs = [...document.querySelectorAll("[role=tab]")];
    const tab = tabs.find((each) => each.textContent.trim() === "Control");
    if (!tab) return;
    const wanted = tab.closest(SHEET) ? "" : "none";
    if (tab.style.display !== wanted) tab.style.display = wanted;
    if (wanted && tab.ariaSelected === "true") tabs[0].click();
  });
})();
