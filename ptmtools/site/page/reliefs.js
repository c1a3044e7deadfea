var H=()=>import("./statues.js");function D({texture:o,factor:e,blends:r,cutoff:t,twoSided:a,extras:n}){return[o,e,r,t,a,n].join()}function $(o){return o<=.0031308?12.92*o:1.055*o**(1/2.4)-.055}var A=(o="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${o}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,F=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,oe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${F}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,j=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,re=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${j}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ne=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${j}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,R={surface:[A(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),oe],item:[A(),re],placeholder:[A(),ne]};function P(o,e,r=R[e]){let t=o.createProgram(),a=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(r.forEach((i,c)=>{let l=o.createShader(a[c]);o.shaderSource(l,i),o.compileShader(l),o.attachShader(t,l),o.deleteShader(l)}),o.linkProgram(t),!o.getProgramParameter(t,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${e}: ${o.getProgramInfoLog(t)}`);let n={},s=o.isContextLost()?0:o.getProgramParameter(t,o.ACTIVE_UNIFORMS);for(let i=0;i<s;i++){let c=o.getActiveUniform(t,i)?.name??"";n[c]=o.getUniformLocation(t,c)}return{program:t,at:n}}function Y(o,{program:e,at:r},t){o.useProgram(e),o.uniform3fv(r.eye,t.eye),o.uniformMatrix3fv(r.turn,!1,t.turn),o.uniform4fv(r.lens,t.lens)}var k=class extends Error{constructor(e,r){super(r),this.code=e}};var se=[.5,.7,.6].map(o=>o/Math.hypot(.5,.7,.6)),U=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${se.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;function q(o,e,r,t=0,a=t){let n=0;for(let s=0;s<3;s++){let i=Math.max(e[t+s]-o[s],o[s]-r[a+s],0);n+=i*i}return Math.sqrt(n)}function K(o,e){let{T:r,K:t,gains:a,previews:{first:n}}=o;if(!X.has(a)){X.add(a);for(let s=0;s<r;s++)if(e[s].normals)for(let[i,c]of[[s,s+1],[r+n[s],r+n[s+1]]])for(let l=i*t;l<c*t;l++)a[l]*=.25}}var X=new WeakSet;var ie=(o,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[o]);var B=ie("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var Ne=Promise.resolve();var J=(o,e)=>o.replace(/\{(\w+)\}/g,(r,t)=>e[t]);var Z=[2,3,4],N=33071,ce={normalWrapS:N,normalWrapT:N},le=.1,fe=A(`
layout(location = 3) in vec2 second;
layout(location = 4) in vec3 up;
layout(location = 5) in vec4 right;
out vec2 at;
out mat3 axes;`,"at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);"),ue=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
uniform float cutoff;
out vec4 shown;
${F}
${U}
void main(){
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(axes*(texture(relief,at).rgb*2.0-1.0));
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,he=U.replace("lit","lamplight"),pe=[A(`
layout(location = 3) in vec2 place2;
layout(location = 4) in vec2 place3;
out vec2 spot;
out vec2 at;`,"spot = place2; at = place3;"),R.surface[1].replace("out vec4 shown;",`out vec4 shown;
uniform mat3 turn;
uniform sampler2D relief;
uniform float scale;
in vec2 at;
${he}`).replace(/shown ?= ?vec4/,`
  vec3 a = dFdx(seen), b = dFdy(seen);
  vec2 p = dFdx(at), q = dFdy(at);
  float side = sign(p.x * q.y - p.y * q.x);
  vec3 up = normalize(cross(a, b)), right = (a * q.y - b * p.y) * side, over = (a * q.x - b * p.x) * side;
  if (dot(right, right) > 0.0) {
    vec3 tilt = texture(relief, at).rgb * 2.0 - 1.0;
    right = normalize(right);
    vec3 across = cross(up, right);
    if (dot(across, over) < 0.0) across = -across;
    vec3 normal = scale * (right * tilt.x + across * tilt.y) + up * tilt.z;
    light *= lamplight(normalize(normal) * turn) / lamplight(up * turn);
  }
  $&`)],L=class{#e=new Map;#i=new WeakMap;#c=new WeakMap;#o=new WeakSet;#r=!1;constructor(e){let{gl:r}=e;this.gl=r,this.walk=e,this.program=P(r,"relief",[fe,ue]),this.bumps=P(r,"bumps",pe),K(e.client.catalogue,e.index.textures)}delete(){for(let e of this.#e.keys())this.#a(e)}has(e){return this.walk.memory.held[e.relief]>0&&this.#n(e)}#n(e){let{relief:r,frames:t,positions:a}=e;if(r<0||this.#o.has(e))return!1;let n=a.length/3,s=t?.every((l,f)=>l.length===Z[f]*n),i=M(e)?1:Z.length,c=this.walk.index.textures[r];return s&&t?.length===i&&c&&(i===1||c.relief!==void 0)?!0:(this.#o.add(e),this.walk.report(new k("PTM-V105",J(B.relief,{name:e.name||B.object}))),!1)}get lacks(){return!this.#r}get levels(){let{index:{textures:e},memory:{held:r}}=this.walk;return e.flatMap(({relief:t,normals:a},n)=>a||t!==void 0?[r[n]]:[])}advance(e,r,t){this.#l();let{gl:a,walk:{client:n,client:{catalogue:{K:s,levels:i}},needs:{present:c}}}=this;if(!c)return;let l=a.drawingBufferWidth*a.drawingBufferHeight,f=!1,x=new Map;for(let{batches:u}of e)for(let{look:h,low:w,high:g}of u){let{relief:p,blends:v,texture:d}=h;if(v||!this.#n(h))continue;if(M(h)&&d>=0){let T=Math.log2(this.#t(h)/this.#t(h,d)),b=`${p} ${d}`,_=x.get(b)??new Float64Array(s);x.set(b,_);for(let S=1;S<=i[p];S++){let z=Math.max(1,i[d]-i[p]+S+T),C=Math.floor(z),[G,te]=[C,C+1].map(W=>W<s?c[d*s+W]:0);_[S]=Math.max(_[S],G+(z-C)*(te-G))}continue}let y=t/2/Math.max(le,q(r,w,g)),[E,O,I]=w.map((T,b)=>g[b]-T),V=Math.min(1,y*y*O*Math.max(E,I)/l),ee=Math.max(0,Math.floor(Math.log2(this.#t(h)/y)));for(let T=1,b=p*s+1;T<=Math.max(1,i[p]-ee);T++,b++)c[b]>=V||(c[b]=V,f=!0)}let m=new Map;for(let[u,h]of x){let w=parseInt(u)*s;h.forEach((g,p)=>m.set(w+p,(m.get(w+p)??0)+g))}for(let[u,h]of m)c[u]>=h||(c[u]=h,f=!0);f&&n.sees(c,n.hidden),this.#r=!0}#l(){if(!this.#e.size)return;let{cells:e}=this.walk.picture.renderer,r=new Set([...e.values()].flatMap(({shapes:t})=>t));for(let t of this.#e.keys())r.has(t)||this.#a(t)}#t(e,r){let t=r===void 0?this.#i:this.#c,a=t.get(e);if(a)return a;let{positions:n,indices:s,relief:i,frames:c,uvs:l}=e,f=r===void 0?c?.[0]:l,{width:x,height:m}=this.walk.index.textures[r??i],u=0,h=0;for(let g=0;g<s.length;g+=3){let[p,v,d]=s.subarray(g,g+3);u+=Q(n,3,p,v,d),h+=Q(f,2,p,v,d)}let w=u*h>0?Math.sqrt(h*x*m/u):1;return t.set(e,w),w}draw(e,r,t,a){let{gl:n,walk:s}=this;for(let l of[this.program,this.bumps])Y(n,l,e),n.uniform1i(l.at.relief,2);let i=!1,c=new Set;for(let{buffers:l,batch:f}of r){if(c.has(f.look))continue;c.add(f.look);let{relief:x,extras:m}=f.look,u=M(f.look),{normalScale:h=1,normalWrapS:w,normalWrapT:g}=u?JSON.parse(m):ce,p=w===N,v=g===N,d=u?this.bumps:this.program;n.useProgram(d.program),n.uniform1f(d.at.scale,h),n.activeTexture(n.TEXTURE2),i=s.memory.of(x)?.bind(p,v,a)||i,n.activeTexture(n.TEXTURE0),i=t(d.at,f)||i;let y=D(f.look);for(let E of l.shapes){if(D(E)!==y)continue;let{array:O,count:I}=this.#f(E);n.bindVertexArray(O),n.drawElements(n.TRIANGLES,I,n.UNSIGNED_INT,0)}}return i}#f(e){let r=this.#e.get(e);if(r)return r;let{gl:t}=this,{positions:a,uvs:n,colors:s,indices:i,frames:c,spots:l}=e,f=t.createVertexArray(),x=i.length;t.bindVertexArray(f);let m=[],[u,h,w=null]=c,g=s&&Float32Array.from(s,d=>$(d/65535)),p=[[0,a,3],[1,n,2],[2,g,4]];M(e)?p.push([3,l,2],[4,u,2]):p.push([3,u,2],[4,h,3],[5,w,4]);for(let[d,y,E]of p)y&&(m.push(this.#s(t.ARRAY_BUFFER,y)),t.enableVertexAttribArray(d),t.vertexAttribPointer(d,E,t.FLOAT,!1,0,0));t.vertexAttrib4f(2,1,1,1,1),m.push(this.#s(t.ELEMENT_ARRAY_BUFFER,Uint32Array.from(i))),t.bindVertexArray(null);let v={array:f,buffers:m,count:x};return this.#e.set(e,v),v}#s(e,r){let{gl:t}=this,a=t.createBuffer();return t.bindBuffer(e,a),t.bufferData(e,r,t.STATIC_DRAW),a}#a(e){let r=this.#e.get(e);if(r){this.gl.deleteVertexArray(r.array);for(let t of r.buffers)this.gl.deleteBuffer(t);this.#e.delete(e)}}},M=({extras:o})=>o.includes("normalCoords");function Q(o,e,r,t,a){let n=m=>[0,1,2].map(u=>u<e?o[e*m+u]-o[e*r+u]:0),[s,i,c]=n(t),[l,f,x]=n(a);return Math.hypot(i*x-c*f,c*l-s*x,s*f-i*l)}async function We(o){o.index.octrees&&(await H()).show(o);let{picture:{renderer:e}}=o,r=new L(o),{statues:t}=e;e.statues=t?de(t,r):r}function de(o,e){return{delete(){o.delete(),e.delete()},has:r=>o.has(r)||e.has(r),get lacks(){return o.lacks||e.lacks},get levels(){return o.levels},get bytes(){return o.bytes},advance(r,t,a,n){o.advance(r,t,a,n),e.advance(r,t,a)},draw(r,t,a,n){let s=({batch:c})=>o.has(c.look),i=o.draw(r,t.filter(s),a,n);return e.draw(r,t.filter(c=>!s(c)),a,n)||i}}}export{We as show};
