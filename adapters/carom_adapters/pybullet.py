adapter = None
