import { App } from "./app.ts";

const app = new App();
app.start();
// For tests, and for who opens the console.
Object.assign(window, { housemartin: app });
