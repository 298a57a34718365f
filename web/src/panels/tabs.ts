import { byId, element } from "./dom.ts";

export interface Tab { name: string; page: HTMLElement; onShow?: (shown: boolean) => void }

/** The panel: one page at a time. On a phone the open tab's button closes it. */
export class Tabs {
  private readonly tabs = new Map<string, Tab & { button: HTMLButtonElement }>();
  private open: string | null = null;

  add(tab: Tab): void {
    const id = `page-${tab.name.toLowerCase()}`;
    const button = element("button", { type: "button", role: "tab", "aria-controls": id, "aria-selected": "false", onclick: () => this.press(tab.name) }, tab.name);
    tab.page.id = id;
    tab.page.setAttribute("role", "tabpanel");
    tab.page.hidden = true;
    byId("tabs").append(button);
    byId("pages").append(tab.page);
    this.tabs.set(tab.name, { ...tab, button });
  }

  show(name: string | null): void {
    this.open = name;
    for (const [other, { page, button, onShow }] of this.tabs) {
      const shown = other === name;
      button.setAttribute("aria-selected", String(shown));
      if (page.hidden === shown) onShow?.(shown);
      page.hidden = !shown;
    }
    byId("panel").dataset.open = String(name !== null);
  }

  private press(name: string): void { this.show(name === this.open ? null : name); }
}
