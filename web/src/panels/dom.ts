type Attributes = Record<string, string | number | boolean | null | undefined | ((event: Event) => void)>;

/** Makes an element: attributes, listeners ("onclick": function), children. */
export function element<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: (Node | string)[]): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, String(value));
  }
  made.append(...children);
  return made;
}

/** The element of index.html with this id. */
export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element '${id}'`);
  return found as T;
}

/** A switch with a label. */
export function toggle(label: string, checked: boolean, onChange: (checked: boolean) => void): HTMLLabelElement {
  const input = element("input", { type: "checkbox", role: "switch", checked, onchange: () => onChange(input.checked) });
  return element("label", { class: "toggle" }, input, element("span", {}, label));
}

/** One of several: a row of buttons; returns the row and a function that chooses. */
export function choice<T extends string>(label: string, values: readonly T[], first: T, onChoose: (value: T) => void) {
  const row = element("div", { class: "choice", role: "radiogroup", "aria-label": label });
  const choose = (value: T): void => {
    for (const button of row.children) {
      const chosen = (button as HTMLElement).dataset.value === value;
      button.setAttribute("aria-checked", String(chosen));
      (button as HTMLElement).tabIndex = chosen ? 0 : -1;
    }
  };
  for (const value of values)
    row.append(element("button", {
      type: "button", role: "radio", "data-value": value, onclick: () => { choose(value); onChoose(value); },
    }, value));
  row.addEventListener("keydown", event => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const at = [...row.children].indexOf(document.activeElement!), next = row.children[(at + step + values.length) % values.length] as HTMLElement;
    next.focus();
    next.click();
  });
  choose(first);
  return { row, choose };
}

export function titled(title: string, ...children: (Node | string)[]): HTMLElement {
  return element("section", { class: "group" }, element("h2", {}, title), ...children);
}
