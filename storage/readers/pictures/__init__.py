"""Pictures of every format to arrays, with their colours: photographs, radiance, textures."""
