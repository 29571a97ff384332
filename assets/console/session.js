/** A random word of this page: the server tells by it who holds a button, and whose pictures are wanted. */
export const SESSION = Array.from(crypto.getRandomValues(new Uint32Array(4)), (one) => one.toString(16)).join('');
