"""The arm: what is known of it (`description`), where its flange is (`model`), the way back (`inverse`)."""
