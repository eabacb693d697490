"""When can object and interference be told apart? Maps over two parameters of a scene."""
