/** Keys of the whole page. `stop` gets the space bar wherever the focus is, before anything else does. */
export function startShortcuts(keys: Record<string, () => void>, stop: () => boolean): void {
  window.addEventListener("keydown", event => {
    if (event.code !== "Space" || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!stop()) return;
    event.preventDefault();
    event.stopPropagation();
  }, { capture: true });
  window.addEventListener("keydown", event => {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || target.matches("input:not([type=range]):not([type=checkbox]), select, textarea")) return;
    if (event.key === "Enter" && (event.repeat || target.matches("button, a, summary, input, dialog *"))) return;  // it presses them
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (act) act();
  });
}
